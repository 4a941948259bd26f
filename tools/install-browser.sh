#!/bin/sh
# Debian's chromium, and the python package that drives it. Safe to run again: does nothing where both are there.
#   tools/install-browser.sh [PYTHON]      PYTHON defaults to .venv/bin/python beside this folder
set -eu

root=$(CDPATH= cd -- "$(dirname -- "$0")/.." && pwd)
python=${1:-$root/.venv/bin/python}

if ! command -v chromium >/dev/null 2>&1; then
    as_root=""
    [ "$(id -u)" -eq 0 ] || as_root="sudo"
    export DEBIAN_FRONTEND=noninteractive
    $as_root apt-get update -q
    $as_root apt-get install -q -y --no-install-recommends chromium fonts-dejavu-core
fi

if ! "$python" -c "import playwright" >/dev/null 2>&1; then
    # The package alone: its own browsers are not downloaded, Debian's is driven.
    if command -v uv >/dev/null 2>&1; then
        uv pip install --quiet --python "$python" "playwright>=1.45"
    elif [ -x "$(dirname -- "$python")/uv" ]; then
        "$(dirname -- "$python")/uv" pip install --quiet --python "$python" "playwright>=1.45"
    else
        "$python" -m pip install --quiet "playwright>=1.45"
    fi
fi

chromium --version
