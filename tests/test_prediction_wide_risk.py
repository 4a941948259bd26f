"""Risk of wide blobs, summed on coarser lattices, against sums over every pair of cells."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.signal import convolve

from sidestep._kernels import risk_profile, risk_wide


def active_in(d: int) -> np.ndarray:
    return np.array([axis >= 3 - d for axis in range(3)], np.int64)


def scattered(d: int, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(d)
    return rng.uniform(-7, 7, (count, 3)) * active_in(d), rng.dirichlet(np.ones(count))


@pytest.mark.parametrize("d", [1, 2, 3])
def test_coarser_shares_follow_from_finer_ones(d: int) -> None:
    """Restricted step by step, or shared out on the coarse lattice at once: the same."""
    places, masses = scattered(d)
    active = active_in(d)
    low = -8 * active
    shares = np.zeros(16 * active + 1)
    risk_wide._share_out(places, masses, 1.0, active, low, shares)
    for level in (1, 2):
        shares, low = risk_wide._coarsen(shares, low, active)
        directly = np.zeros(shares.shape)
        risk_wide._share_out(places, masses, 0.5**level, active, low, directly)
        np.testing.assert_allclose(shares, directly, atol=1e-15)
    assert shares.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("shift", [-3, 0, 2])
def test_blur_is_a_convolution(d: int, shift: int) -> None:
    rng = np.random.default_rng(d)
    active = active_in(d)
    source, before = rng.random(5 * active + 1) / 40, rng.random(7 * active + 1) / 2
    ring = np.sqrt((np.stack(np.indices(3 * active + 1)) ** 2).sum(axis=0))
    kernel = np.where(ring < 3.2, np.exp(-ring), 0.0).astype(np.float32)
    whole = kernel[np.ix_(*(np.abs(np.arange(-3 * a, 3 * a + 1)) for a in active))].astype(np.float64)
    blurred = np.zeros(25 * active + 1)  # from cell −10 on, the source from cell 0
    blurred[tuple(slice(7 * a, 7 * a + 12 * a + (1 - a)) for a in active)] = convolve(source, whole)[
        tuple(slice(0, 12 * a + (1 - a)) for a in active)
    ]
    there = blurred[tuple(slice((10 + shift) * a, (10 + shift) * a + 7 * a + 1) for a in active)]
    total = before.ravel().copy()
    risk_wide._blur(source, 0 * active, kernel, total, shift * active, np.array(before.shape))
    np.testing.assert_allclose(total.reshape(before.shape), 1 - (1 - before) * (1 - np.minimum(there, 1)), atol=1e-6)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_wide_blobs_lie_on_the_level_of_their_width(d: int) -> None:
    """Each class on the coarsest lattice on which it is smooth; read there, it is the blob itself."""
    places, masses = scattered(d)
    active, table, spacing, limit = active_in(d), risk_profile.blob_table(d), 0.1, 0.05
    weights, sigmas = np.array([0.5, 0.3, 0.2]), np.array([0.16, 0.3, 0.7])
    low, size = -9 * active, 18 * active + 1
    lows, sizes, starts = risk_wide.coarse_boxes(low, size, active)
    totals = np.zeros(starts[-1])
    bounds = np.stack([places.min(axis=0), places.max(axis=0)])
    assert risk_wide.add_wide(
        places, masses, bounds, 0.8, weights, sigmas, 0.0, spacing, active, table, limit, lows, sizes, starts, totals
    )
    for level in (1, 2, 3):
        found = totals[starts[level] : starts[level + 1]].reshape(sizes[level])
        cells = itertools.product(*(range(n) for n in sizes[level]))
        gaps = [np.linalg.norm((lows[level] + cell) * 2**level - places, axis=1) * spacing for cell in list(cells)[::7]]
        exact = [
            sum(
                weights[level - 1] * m * risk_profile.blob(g, 0.8, sigmas[level - 1], table)
                for g, m in zip(gap, masses, strict=True)
            )
            for gap in gaps
        ]
        np.testing.assert_allclose(found.ravel()[::7], exact, atol=0.1 * limit)
        assert found.max() > 0.3 * limit
