#!/usr/bin/env bash
# Renew the pinned, hashed requirements: run.txt is what `sidestep` itself needs, test.txt what tests, checks and site need on top.
# --universal: one file for Python 3.11 to 3.13 and every platform. No registry is named, so that any mirror serves.
set -euo pipefail
cd "$(dirname "$0")/.."
compile() {
    .venv/bin/uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
        --no-emit-index-url --no-emit-find-links --no-header --no-annotate --quiet "$@"
}
compile --upgrade --group build -o requirements/run.txt
compile --upgrade --group build --group dev -c requirements/run.txt \
    --extra docs --extra live --extra studies --extra gym --extra peers --extra lab -o requirements/test.txt
