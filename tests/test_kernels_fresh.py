"""Compiled code never outlives the sources it was made of, its own file or another's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sidestep._kernels import forget_outdated

CALLED = "from numba import njit\n\n@njit(cache=True)\ndef number():\n    return {}\n"
CALLER = (
    CALLED.replace("\n\n", "\nfrom inner.called import number\n\n")
    .replace("number():", "twice():")
    .format("2 * number()")
)


def test_only_what_changed_and_what_calls_it_is_compiled_again(tmp_path: Path) -> None:
    sources = {
        "__init__": "",
        "inner": "x = 1\n",
        "middle": "from package.inner import x\n",
        "outer": "from package import (\n    middle,\n)\n",
        "other": "import numpy\n",
    }
    for name, text in sources.items():
        (tmp_path / f"{name}.py").write_text(text)
    assert forget_outdated(tmp_path) == set(sources)
    cache = tmp_path / "__pycache__"
    compiled = {name: [cache / f"{name}.f-1.py311{end}" for end in (".nbi", ".1.nbc")] for name in sources}
    plain = cache / "inner.cpython-311.pyc"
    for path in (plain, *(p for pair in compiled.values() for p in pair)):
        path.write_text("")
    assert forget_outdated(tmp_path) == set()
    assert all(path.exists() for pair in compiled.values() for path in pair)
    for changed, text, outdated in (
        ("outer", "x = 2\n", {"outer"}),
        ("outer", sources["outer"] + "\n", {"outer"}),
        ("inner", "x = 17\n", {"inner", "middle", "outer"}),
        ("new", "", {"new"}),
    ):
        (tmp_path / f"{changed}.py").write_text(text)
        assert forget_outdated(tmp_path) == outdated
        for name, pair in compiled.items():
            assert [path.exists() for path in pair] == [name not in outdated] * 2
            for path in pair:
                path.write_text("")
        assert forget_outdated(tmp_path) == set()
    assert plain.exists()


def test_a_folder_that_cannot_be_written_to_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.py").write_text("")
    blocked = tmp_path / "__pycache__"
    blocked.write_text("a file where the folder would be")
    assert forget_outdated(tmp_path) == {"a"}
    assert forget_outdated(tmp_path) == {"a"}
    blocked.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda *_: False)
        assert forget_outdated(tmp_path) == set()
        assert not blocked.exists()
    assert forget_outdated(tmp_path) == {"a"}


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
