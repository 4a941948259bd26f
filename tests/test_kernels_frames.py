"""Vectors between frames, against matrix products."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sidestep._kernels.frames import local, turned


@given(seed=st.integers(0, 10**6), d=st.sampled_from([1, 2, 3]))
def test_frames_are_matrix_products(seed, d):
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(d, d)))
    vectors, origin = rng.normal(size=(7, d)), rng.normal(size=d)
    for one, other in ((turned, local), (turned.py_func, local.py_func)):
        assert one(vectors, rotation, 0.3) == pytest.approx(0.3 * vectors @ rotation.T)
        assert other(vectors[0], origin, rotation) == pytest.approx((vectors[0] - origin) @ rotation)
