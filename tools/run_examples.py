"""Run all examples; each must end well and leave its picture.

python tools/run_examples.py [FOLDER]        (runs/examples unless given)
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main(folder: Path) -> int:
    """Run them; exit status 1 if one failed."""
    folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    for script in sorted((ROOT / "examples").glob("[0-9]*.py")):
        began = time.perf_counter()
        done = subprocess.run([sys.executable, "-W", "error", str(script), str(folder)], cwd=folder, check=False)
        fine = done.returncode == 0 and (folder / f"{script.stem}.png").exists()
        failed += not fine
        print(f"{script.name}: {'ok' if fine else 'FAILED'}, {time.perf_counter() - began:.1f} s", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "runs" / "examples"))
