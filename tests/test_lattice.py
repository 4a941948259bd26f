"""Cells and positions: what a lattice may be, and that it is the same one whatever its radius."""

from __future__ import annotations

import numpy as np
import pytest

from sidestep import InvalidInput, Lattice
from sidestep.lattice import heading_rotation

GIVEN = {"origin": (1.0, 2.0), "spacing": 0.25, "radius": 3}


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("origin", "here"), ("origin", 1.0), ("origin", (1.0, np.nan)), ("origin", (1.0, 2.0, 3.0, 4.0)),
        ("spacing", 0.0), ("spacing", -0.25), ("spacing", np.nan), ("spacing", "wide"), ("spacing", True),
        ("radius", -1), ("radius", 1.5), ("radius", True), ("radius", None),
        ("rotation", np.eye(3)), ("rotation", 2.0 * np.eye(2)), ("rotation", [[1.0, 1.0], [0.0, 1.0]]),
        ("rotation", "east"),
    ],
)  # fmt: skip
def test_what_is_no_lattice_is_refused_in_a_line_that_names_the_field(field, value):
    with pytest.raises(InvalidInput) as refused:
        Lattice(**(GIVEN | {field: value}))
    assert refused.value.field == f"lattice.{field}"
    assert len(str(refused.value).splitlines()) == 1


def test_numbers_of_any_kind_make_a_lattice():
    lattice = Lattice(origin=[1, 2], spacing=np.float32(0.25), radius=np.int64(3), rotation=[[0, -1], [1, 0]])
    assert lattice.shape == (7, 7)
    assert type(lattice.radius) is int
    assert type(lattice.spacing) is float
    assert not lattice.origin.flags.writeable
    assert not lattice.rotation.flags.writeable


@pytest.mark.parametrize("d", [1, 2, 3])
def test_another_radius_leaves_the_cells_where_they_are(d):
    rng = np.random.default_rng(d)
    lattice = Lattice(origin=rng.normal(size=d), spacing=0.3, radius=2, rotation=heading_rotation(rng.normal(size=d)))
    wider = lattice.with_radius(3)
    inner = (slice(1, -1),) * d
    assert np.array_equal(wider.positions()[inner], lattice.positions())
    assert lattice.to_world(lattice.to_local(wider.positions())) == pytest.approx(wider.positions())
    with pytest.raises(InvalidInput, match=r"lattice\.radius"):
        lattice.with_radius(-1)
