#!/usr/bin/env bash
# Debian's chromium, and the python package that drives it (the package alone: no browser of its own is downloaded).
# Usage: install-browser.sh [PYTHON]; PYTHON is .venv/bin/python unless given. Does nothing where both are there.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
python=${1:-$here/../.venv/bin/python}
"$here/install_apt.sh" "browser tests" chromium fonts-dejavu-core
if ! "$python" -c "import playwright" 2>/dev/null; then
    echo "browser tests: installing playwright"
    "$(dirname "$python")/uv" pip install --quiet --python "$python" "playwright==1.65.2"
fi
