#!/usr/bin/env bash
# Make .venv with the given Python and put uv in it. Works where the distribution keeps venv or pip in packages of their own.
set -euo pipefail
python=${1:-python3}
cd "$(dirname "$0")/.."

if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    echo "sidestep needs Python 3.11 or newer; '$python' is not. Name one: make PYTHON=/path/to/python3.11" >&2
    exit 1
fi

make_venv() { "$python" -m venv .venv >/dev/null 2>&1; }

if ! make_venv; then
    # Debian: venv lives in python3-venv.
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq python3-venv >/dev/null
        make_venv
    elif "$python" -m pip --version >/dev/null 2>&1; then
        rm -rf .venv && "$python" -m venv --without-pip .venv
        "$python" -m pip --python .venv/bin/python install --quiet pip
    else
        rm -rf .venv
        echo "'$python -m venv' does not work here; on Debian: apt install python3-venv" >&2
        exit 1
    fi
fi
.venv/bin/python -m pip install --quiet --disable-pip-version-check "uv>=0.5"
