"""Cluster features → probability of being a leg, both legs at once, or something else."""

from __future__ import annotations

import importlib.resources
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from sidestep._kernels.forest import sum_of_leaves
from sidestep.archives import read_arrays
from sidestep.errors import InvalidFile
from sidestep.perception.clusters import FEATURES
from sidestep.types import FloatArray

CLASSES = ("other", "leg", "both legs")
"""What a cluster can be."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LegClassifier:
    """Boosted decision trees over `clusters.FEATURES`, as plain arrays. T trees, M nodes in all.

    Trained with balanced classes: the ratio of two probabilities is a likelihood ratio, free of any prior.

    Attributes:
        base: (len(CLASSES),) scores before any tree.
        roots: (T,) node at which each tree begins; tree t adds to the score of class t mod len(CLASSES).
        features: (M,) column that each node looks at; −1 marks a leaf.
        thresholds: (M,) left where the value is ≤ the threshold.
        children: (M, 2) nodes.
        values: (M,) of the leaves.
    """

    base: FloatArray
    roots: NDArray[np.int32]
    features: NDArray[np.int16]
    thresholds: NDArray[np.float32]
    children: NDArray[np.int32]
    values: NDArray[np.float32]

    def probabilities(self, features: FloatArray) -> FloatArray:
        """Return (C, len(CLASSES)) probabilities for features (C, len(FEATURES))."""
        arrays = (self.roots, self.features, self.thresholds, self.children, self.values)
        scores = self.base + sum_of_leaves(features, *arrays, len(CLASSES))
        weights = np.exp(scores - scores.max(axis=1, keepdims=True))
        return weights / weights.sum(axis=1, keepdims=True)

    @cached_property
    def size(self) -> int:
        """Number of nodes."""
        return int(self.features.size)

    def save(self, file: IO[bytes]) -> None:
        """Write a `.npz` archive of plain arrays (nothing in it is executed on reading) to an open file."""
        np.savez_compressed(
            file,
            base=self.base,
            roots=self.roots,
            features=self.features,
            thresholds=self.thresholds,
            children=self.children,
            values=self.values,
            columns=np.array(FEATURES),
        )


def load_classifier(path: str | Path | None = None) -> LegClassifier:
    """Read a classifier; without `path` the one that comes with the package, trained on simulated scans.

    Raises:
        InvalidFile: the file is no classifier, or was trained on other features.
    """
    if path is None:
        with importlib.resources.as_file(importlib.resources.files("sidestep.perception") / "legs.npz") as shipped:
            return _read(shipped)
    return _read(Path(path))


def _read(path: Path) -> LegClassifier:
    what = "a classifier written by `sidestep lab --train`"
    arrays = read_arrays(path, what)
    try:
        classifier = LegClassifier(
            base=arrays["base"].astype(np.float64),
            roots=arrays["roots"].astype(np.int32),
            features=arrays["features"].astype(np.int16),
            thresholds=arrays["thresholds"].astype(np.float32),
            children=arrays["children"].astype(np.int32),
            values=arrays["values"].astype(np.float32),
        )
        columns = tuple(str(name) for name in arrays["columns"])
    except (ValueError, TypeError, KeyError) as error:
        raise InvalidFile(str(path), str(error), what) from None
    if columns != FEATURES or not _sound(classifier):
        raise InvalidFile(str(path), columns, "trained on the features of this version", "train it again")
    return classifier


def _sound(c: LegClassifier) -> bool:
    """Return whether every node points forward to nodes that exist: then each walk ends at a leaf."""
    count = c.size
    inner = c.features >= 0
    here = np.arange(count)[inner, None]
    return bool(
        c.thresholds.shape == (count,)
        and c.children.shape == (count, 2)
        and c.values.shape == (count,)
        and c.base.shape == (len(CLASSES),)
        and c.roots.size > 0
        and np.all((c.roots >= 0) & (c.roots < count))
        and np.all(c.features < len(FEATURES))
        and np.all((c.children[inner] > here) & (c.children[inner] < count))
    )
