"""Evaluation of decision trees stored as flat arrays."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep._kernels.options import KERNEL
from sidestep.types import FloatArray


@njit(**KERNEL)
def sum_of_leaves(
    samples: FloatArray,
    roots: NDArray[np.int32],
    features: NDArray[np.int16],
    thresholds: NDArray[np.float32],
    children: NDArray[np.int32],
    values: NDArray[np.float32],
    outputs: int,
) -> FloatArray:
    """Return (S, K): for each output the sum of the leaves that a sample falls into.

    Args:
        samples: (S, F).
        roots: (T,) node at which each tree begins; tree t adds to output t mod K.
        features: (M,) column that each node looks at; −1 marks a leaf.
        thresholds: (M,) a sample goes left where its value is ≤ the threshold (compared in single precision).
        children: (M, 2) left and right child.
        values: (M,) of the leaves.
        outputs: K.
    """
    out = np.zeros((samples.shape[0], outputs))
    for s in range(samples.shape[0]):
        for t in range(roots.size):
            node = roots[t]
            while features[node] >= 0:
                right = np.float32(samples[s, features[node]]) > thresholds[node]
                node = children[node, 1 if right else 0]
            out[s, t % outputs] += values[node]
    return out
