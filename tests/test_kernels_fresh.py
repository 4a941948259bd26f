"""Compiled code never outlives the sources it was made of, its own file or another's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from sidestep._kernels import forget_outdated

CALLED = "from numba import njit\n\n@njit(cache=True)\ndef number():\n    return {}\n"
CALLER = (
    CALLED.replace("\n\n", "\nfrom inner.called import number\n\n")
    .replace("number():", "twice():")
    .format("2 * number()")
)


def test_compiled_code_is_kept_while_the_sources_are_and_dropped_after(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("a = 1\n")
    assert forget_outdated(tmp_path)
    compiled = [tmp_path / "__pycache__" / name for name in ("a.f-1.py311.nbi", "a.f-1.py311.1.nbc")]
    other = tmp_path / "__pycache__" / "a.cpython-311.pyc"
    for path in (*compiled, other):
        path.write_text("")
    assert not forget_outdated(tmp_path)
    assert all(path.exists() for path in compiled)
    for change in ("a = 2\nb = 3\n", None):
        if change:
            (tmp_path / "a.py").write_text(change)
        else:
            (tmp_path / "b.py").write_text("")
        assert forget_outdated(tmp_path)
        assert not any(path.exists() for path in compiled)
        assert other.exists()
        compiled[0].write_text("")
    assert not forget_outdated(tmp_path)


def test_a_folder_that_cannot_be_written_to_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("")
    (tmp_path / "__pycache__").write_text("a file where the folder would be")
    assert forget_outdated(tmp_path)
    assert forget_outdated(tmp_path)


def test_a_kernel_follows_the_kernels_it_calls(tmp_path: Path) -> None:
    """What numba alone would get wrong: the caller's file stays, the called one changes."""
    package = tmp_path / "inner"
    package.mkdir()
    (package / "__init__.py").write_text(
        "import pathlib, sidestep._kernels as kernels\nkernels.forget_outdated(pathlib.Path(__file__).parent)\n"
    )
    (package / "caller.py").write_text(CALLER)
    found = []
    for number in (1, 21):
        (package / "called.py").write_text(CALLED.format(number))
        told = subprocess.run(
            [sys.executable, "-c", "from inner.caller import twice; print(twice())"],
            cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        found.append(int(told.stdout))
    assert found == [2, 42]
