"""Maps as ROS map_server writes them."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep.errors import InvalidFile
from sidestep.io.maps import read_map
from sidestep.obstacles import Obstacles

PIXELS = np.array([[254, 254, 254, 205], [0, 254, 254, 205], [0, 0, 254, 205]], dtype=np.uint8)  # the top row first
YAML = """# made by hand
image: room.pgm
resolution: 0.5   # m
origin: [-1.0, 2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def write(folder, yaml=YAML, pixels=PIXELS, *, plain=False, top=255):
    header = f"{'P2' if plain else 'P5'}\n# CREATOR: a test\n{pixels.shape[1]} {pixels.shape[0]}\n{top}\n".encode()
    wide = pixels.astype(">u2") if top > 255 else pixels
    body = " ".join(str(v) for v in pixels.ravel()).encode() if plain else wide.tobytes()
    (folder / "room.pgm").write_bytes(header + body)
    (folder / "room.yaml").write_text(yaml)
    return folder / "room.yaml"


@pytest.mark.parametrize("plain", [False, True])
def test_pixels_become_cells_with_the_lower_left_corner_at_the_origin(tmp_path, plain):
    grid = read_map(write(tmp_path, plain=plain), unknown_is_free=True)
    assert grid.occupied.shape == (4, 3)
    assert grid.occupied[:, 0].tolist() == [True, True, False, False]  # the lowest row of the image
    assert grid.occupied[:, 1].tolist() == [True, False, False, False]
    assert not grid.occupied[:, 2].any()
    walls = Obstacles(grid=grid)
    assert float(walls.distance((-0.75, 2.25))) < 0
    assert float(walls.distance((0.75, 2.25))) == pytest.approx(0.75)
    assert walls.bounds == pytest.approx((-1.0, 2.0, 1.0, 3.5))


def test_unknown_pixels_are_walls_unless_told_otherwise(tmp_path):
    path = write(tmp_path)
    assert read_map(path).occupied[3].all()
    assert not read_map(path, unknown_is_free=True).occupied[3].any()


def test_negate_sixteen_bits_and_block_lists(tmp_path):
    inverted = read_map(write(tmp_path, YAML.replace("negate: 0", "negate: 1"), 254 - PIXELS), unknown_is_free=True)
    assert (inverted.occupied == read_map(write(tmp_path), unknown_is_free=True).occupied).all()
    wide = read_map(write(tmp_path, pixels=PIXELS.astype(np.uint16) * 257, top=65535))
    assert (wide.occupied == read_map(write(tmp_path)).occupied).all()
    listed = YAML.replace("origin: [-1.0, 2.0, 0.0]", "origin:\n- -1.0\n- 2.0\n- 0.5")
    grid = read_map(write(tmp_path, listed))
    assert grid.origin == (-1.0, 2.0)
    assert grid.yaw == 0.5


def test_sixteen_bits_with_an_odd_byte_behind_the_last_pixel_and_a_mode_in_quotes(tmp_path):
    path = write(tmp_path, YAML + 'mode: "trinary"\n', pixels=PIXELS.astype(np.uint16) * 257, top=65535)
    expected = read_map(path).occupied
    image = tmp_path / "room.pgm"
    image.write_bytes(image.read_bytes() + b"\n")
    assert (read_map(path).occupied == expected).all()
    assert expected[3].all()


def test_png_with_colours_and_transparency(tmp_path):
    from matplotlib.image import imsave

    pixels = np.ones((2, 2, 4))
    pixels[0, 0, :3] = 0.0
    pixels[1, 1, 3] = 0.0
    imsave(tmp_path / "room.png", pixels)
    path = write(tmp_path, YAML.replace("room.pgm", "room.png"))
    assert read_map(path).occupied.tolist() == [[False, True], [True, False]]
    assert read_map(path, unknown_is_free=True).occupied.tolist() == [[False, True], [False, False]]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("resolution: 0.5", "resolution: -1"), "resolution"),
        (("resolution: 0.5", "resolution: wide"), "resolution"),
        (("image: room.pgm", "image: other.pgm"), "other.pgm"),
        (("image: room.pgm", ""), "image"),
        (("[-1.0, 2.0, 0.0]", "[-1.0]"), "origin"),
        (("[-1.0, 2.0, 0.0]", "[a, b, c]"), "origin"),
        (("negate: 0", "negate: 0\nmode: raw"), "mode"),
        (("negate: 0", "negate 0"), "line"),
        (("free_thresh: 0.196", "free_thresh: .nan"), "free_thresh"),
        (("free_thresh: 0.196", "free_thresh: 0.7"), "free_thresh 0.7, occupied_thresh 0.65"),
        (("occupied_thresh: 0.65\nfree_thresh: 0.196", "occupied_thresh: 65\nfree_thresh: 19.6"), "not percent"),
        (("occupied_thresh: 0.65", "occupied_thresh: -0.1"), "free_thresh"),
    ],
)
def test_bad_maps_are_refused_in_one_line(tmp_path, change, named):
    path = write(tmp_path, YAML.replace(*change))
    with pytest.raises(InvalidFile, match=rf"^[^\n]*{named}[^\n]*$"):
        read_map(path)


def test_bad_images_are_refused_in_one_line(tmp_path):
    path = write(tmp_path)
    for content in (
        b"P5\n4 3\n255\n123",
        b"P5\n4 3\n65535\n123",
        b"P5\n4 3\n255\n",
        b"GIF89a",
        b"P2\n2 1\n255\n1 x",
        b"P5\n0 0\n255\n",
    ):
        (tmp_path / "room.pgm").write_bytes(content)
        with pytest.raises(InvalidFile, match=r"^[^\n]*room.pgm[^\n]*$"):
            read_map(path)
    (tmp_path / "room.png").write_bytes(b"no image")
    with pytest.raises(InvalidFile, match=r"room.png"):
        read_map(write(tmp_path, YAML.replace("room.pgm", "room.png")))
    with pytest.raises(InvalidFile, match=r"missing.yaml"):
        read_map(tmp_path / "missing.yaml")
