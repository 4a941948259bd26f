"""Evaluation of decision trees stored as flat arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sidestep.types import FloatArray


@njit(cache=True)
def mean_leaf_values(
    samples: FloatArray,
    roots: NDArray[np.int32],
    features: NDArray[np.int16],
    thresholds: NDArray[np.float32],
    children: NDArray[np.int32],
    values: NDArray[np.float32],
) -> Any:
    """Return (S, K): the mean over all trees of the value of the leaf that each sample falls into.

    Args:
        samples: (S, F).
        roots: (T,) node at which each tree begins.
        features: (M,) column that each node looks at; −1 marks a leaf.
        thresholds: (M,) a sample goes left where its value is ≤ the threshold (compared in single precision).
        children: (M, 2) left and right child.
        values: (M, K) class probabilities of each leaf.
    """
    out = np.zeros((samples.shape[0], values.shape[1]))
    for s in range(samples.shape[0]):
        for t in range(roots.size):
            node = roots[t]
            while features[node] >= 0:
                right = np.float32(samples[s, features[node]]) > thresholds[node]
                node = children[node, 1 if right else 0]
            for k in range(values.shape[1]):
                out[s, k] += values[node, k]
    return out / roots.size
