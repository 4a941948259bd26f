#!/usr/bin/env bash
# Build wheel and sdist, install the wheel into an empty environment, and do there what the README tells newcomers to do.
# --keep DIR leaves the two files in DIR.
set -euo pipefail
cd "$(dirname "$0")/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

.venv/bin/hatchling build -d "$work/dist" >/dev/null 2>&1
wheel=$(ls "$work"/dist/*.whl)
sdist=$(ls "$work"/dist/*.tar.gz)

.venv/bin/python - "$wheel" "$sdist" <<'PYTHON'
import sys, tarfile, zipfile

wheel, sdist = sys.argv[1:]
held = zipfile.ZipFile(wheel).namelist()
for needed in ("sidestep/py.typed", "sidestep/cli.py", "sidestep/scenarios/crossing.toml", "licenses/LICENSE"):
    assert any(name.endswith(needed) for name in held), f"{wheel} lacks {needed}"
strange = [n for n in held if not n.startswith(("sidestep/", "sidestep-"))]
assert not strange, f"{wheel} brings {strange}"
sources = tarfile.open(sdist).getnames()
for needed in ("pyproject.toml", "README.md", "LICENSE", "src/sidestep/__init__.py"):
    assert any(name.endswith("/" + needed) for name in sources), f"{sdist} lacks {needed}"
print(f"wheel: {len(held)} files; sdist: {len(sources)} files")
PYTHON

.venv/bin/python -m venv --without-pip "$work/env"
uv=.venv/bin/uv
$uv pip install --quiet --python "$work/env/bin/python" -c requirements/run.txt "$wheel"
$uv pip check --quiet --python "$work/env/bin/python"
"$work/env/bin/python" tools/document_blocks.py README.md

if [ "${1:-}" = --keep ]; then
    mkdir -p "$2"
    cp "$wheel" "$sdist" "$2"
fi
echo "package: the README's quickstart runs from $(basename "$wheel") in an empty environment"
