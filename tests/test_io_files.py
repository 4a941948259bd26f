"""Files take the place of files, whole or not at all; nothing else is replaced."""

from __future__ import annotations

import os

import pytest

from sidestep.errors import OutputError
from sidestep.io.files import ready_for, written


def test_a_file_is_replaced_when_the_block_ends_well(tmp_path):
    path = tmp_path / "page.json"
    path.write_text("old")
    with written(path) as file:
        file.write(b"new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    with pytest.raises(TypeError), written(path) as file:
        file.write("half")  # pyright: ignore[reportArgumentType]
    assert [p.read_text() for p in tmp_path.iterdir()] == ["new"]


@pytest.mark.parametrize("make", [os.mkdir, os.mkfifo])
def test_what_is_no_file_is_not_replaced(make, tmp_path):
    path = tmp_path / "page.json"
    make(path)
    with pytest.raises(OutputError, match="it is there, and no file"):
        ready_for(path)
    with pytest.raises(OutputError, match="it is there, and no file"), written(path) as file:
        file.write(b"new")
    assert path.exists()
    assert not path.is_file()
