"""Training the leg classifier on simulated scans, or on labelled recordings."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from sidestep.errors import InvalidInput, MissingExtra
from sidestep.perception.classifier import CLASSES, LegClassifier
from sidestep.perception.clusters import find_clusters
from sidestep.perception.scan import Beams, ScanRecording
from sidestep.simulation.gait import Gait
from sidestep.simulation.lidar import Scanner
from sidestep.simulation.rooms import random_room
from sidestep.simulation.scene import Scene
from sidestep.types import FloatArray, IntArray

_SCANS_PER_ROOM = 4
_MOSTLY = 0.6  # share of a cluster's beams that must have fallen on legs
_BOTH = 0.2  # share of the other leg from which a cluster counts as both


def simulated_samples(generator: np.random.Generator, *, scans: int) -> tuple[FloatArray, IntArray]:
    """Return features (S, F) and classes (S,) of all clusters in `scans` scans of random rooms, people and scanners."""
    features: list[FloatArray] = []
    classes: list[IntArray] = []
    while len(features) < scans:
        outdoors = generator.random() < 0.15
        scene = _outdoors(generator) if outdoors else random_room(generator)
        for _ in range(_SCANS_PER_ROOM):
            scanner = _random_scanner(generator, outdoors=outdoors)
            legs = _random_people(generator)
            pose = np.array([*generator.uniform(-2.5, 2.5, 2), generator.uniform(-np.pi, np.pi)])
            scan, hits = scanner.sense(scene, legs, pose, np.zeros(3), 0.0, generator)
            clusters = find_clusters(scan)
            features.append(clusters.features)
            classes.append(_classes(hits[clusters.beam], clusters.start))
    return np.concatenate(features), np.concatenate(classes)


def recorded_samples(recordings: Sequence[ScanRecording]) -> tuple[FloatArray, IntArray]:
    """Return features (S, F) and classes (S,) from recordings.

    Labelled legs are positive (both legs where a cluster is wider than one, or bears two labels). What is not labelled
    is unknown, and left out, except in recordings without any labels: these are taken to show nobody.
    """
    features: list[FloatArray] = []
    classes: list[IntArray] = []
    for recording in recordings:
        rows = np.arange(len(recording)) if recording.legs is None else recording.legs.scans
        for row in rows:
            clusters = find_clusters(recording.scan(int(row)))
            if recording.legs is None:
                features.append(clusters.features)
                classes.append(np.zeros(len(clusters), dtype=np.int64))
                continue
            marked = _classes(recording.legs.beams[row][clusters.beam], clusters.start)
            both = (clusters.feature("width") > 0.24) | (marked == 2)
            features.append(clusters.features[marked > 0])
            classes.append(np.where(both, 2, 1)[marked > 0])
    if not features:
        raise InvalidInput("train", "no recordings", "at least one labelled recording")
    return np.concatenate(features), np.concatenate(classes)


def train(features: FloatArray, classes: IntArray, *, seed: int, rounds: int = 100, leaves: int = 16) -> LegClassifier:
    """Fit boosted trees with balanced classes and return them as plain arrays.

    Args:
        features: (S, F).
        classes: (S,) indices into `classifier.CLASSES`.
        seed: of the samples and features that each tree sees.
        rounds: of boosting, one tree per class each.
        leaves: of each tree.

    Raises:
        MissingExtra: scikit-learn is not installed.
        InvalidInput: a class is missing among the samples.
    """
    try:
        from sklearn.ensemble import GradientBoostingClassifier
    except ImportError:
        raise MissingExtra("training the leg classifier", "lab") from None
    found, count = np.unique(classes, return_counts=True)
    if found.tolist() != list(range(len(CLASSES))):
        raise InvalidInput("train: classes", found.tolist(), "legs, both legs and other things among the samples")
    weight = (classes.size / len(CLASSES) / count)[classes]
    model = GradientBoostingClassifier(
        n_estimators=rounds, learning_rate=0.1, max_leaf_nodes=leaves, max_depth=16, min_samples_leaf=20,
        subsample=0.3, max_features=6, random_state=seed,
    )  # fmt: skip
    model.fit(features, classes, sample_weight=weight)
    return _as_arrays([tree.tree_ for tree in model.estimators_.ravel()], model.learning_rate)


def confusion(classifier: LegClassifier, features: FloatArray, classes: IntArray) -> dict[str, dict[str, float]]:
    """Return for each true class the shares of the samples that are taken for each class."""
    guess = np.argmax(classifier.probabilities(features), axis=1)
    return {
        name: {other: float(np.mean(guess[classes == k] == j)) for j, other in enumerate(CLASSES)}
        for k, name in enumerate(CLASSES)
        if np.any(classes == k)
    }


def _as_arrays(trees: Sequence[Any], learning_rate: float) -> LegClassifier:
    sizes = np.array([tree.node_count for tree in trees])
    roots = np.concatenate(([0], np.cumsum(sizes)[:-1]))
    children = [np.stack((t.children_left, t.children_right), axis=1) + r for t, r in zip(trees, roots, strict=True)]
    return LegClassifier(
        base=np.zeros(len(CLASSES)),  # balanced: every class begins alike
        roots=roots.astype(np.int32),
        features=np.maximum(np.concatenate([tree.feature for tree in trees]), -1).astype(np.int16),
        thresholds=_rounded_down(np.concatenate([tree.threshold for tree in trees])),
        children=np.concatenate(children).astype(np.int32),
        values=(learning_rate * np.concatenate([tree.value[:, 0, 0] for tree in trees])).astype(np.float32),
    )


def _rounded_down(thresholds: FloatArray) -> Any:
    """Return the largest float32 ≤ each threshold: for float32 samples, comparing with it decides alike."""
    nearest = thresholds.astype(np.float32)
    return np.where(nearest > thresholds, np.nextafter(nearest, np.float32(-np.inf)), nearest)


def _classes(hits: IntArray, start: IntArray) -> IntArray:
    """Return (C,) 0 other, 1 leg, 2 both legs, given what each return hit (odd k and k + 1 are one person's legs)."""
    classes = np.zeros(start.size - 1, dtype=np.int64)
    for c, (first, last) in enumerate(itertools.pairwise(start)):
        on_legs = hits[first:last][hits[first:last] > 0]
        if on_legs.size < _MOSTLY * (last - first):
            continue
        _, count = np.unique(on_legs, return_counts=True)
        classes[c] = 2 if count.size > 1 and np.sort(count)[-2] >= _BOTH * count.sum() else 1
    return classes


def _random_scanner(generator: np.random.Generator, *, outdoors: bool) -> Scanner:
    """Draw a scanner between the usual makes: 0.25° to 0.5°, 90° to all round, 3 to 20 mm of noise."""
    increment = np.radians(generator.uniform(0.25, 0.5))
    view = generator.choice([np.pi / 2, np.pi, 1.5 * np.pi, 2 * np.pi])
    count = int(view / increment)
    beams = Beams(
        count=count,
        angle_min=-view / 2,
        angle_increment=view / count,
        range_min=generator.uniform(0.02, 0.15),
        range_max=generator.choice([5.6, 10.0, 11.0, 30.0]),
    )
    return Scanner(
        beams=beams,
        noise=generator.uniform(0.002, 0.018),
        noise_share=generator.uniform(0.0, 0.005),
        missing=generator.choice([0.0, 0.02, 0.08]),
        failed=generator.uniform(0.05, 0.15) if outdoors else generator.choice([0.0, 0.01]),
        mixed=generator.uniform(0.0, 0.6),
        spurious=generator.uniform(0.0, 0.02) if outdoors else generator.uniform(0.0, 0.002),
    )


def _random_people(generator: np.random.Generator) -> FloatArray:
    """Draw the legs (2·P, 5) of people who stand or walk anywhere within 7 m, more of them near the middle."""
    legs: list[FloatArray] = []
    for _ in range(generator.integers(0, 8)):
        distance, bearing = 7.0 * generator.random() ** 0.8, generator.uniform(-np.pi, np.pi)
        heading = generator.uniform(-np.pi, np.pi)
        speed = 0.0 if generator.random() < 0.3 else generator.uniform(0.2, 1.8)
        position = distance * np.array([np.cos(bearing), np.sin(bearing)])
        velocity = speed * np.array([np.cos(heading), np.sin(heading)])
        legs.append(Gait.random(generator).legs(position, velocity, heading, generator.uniform(0, 2 * np.pi)))
    return np.concatenate(legs) if legs else np.zeros((0, 5))


def _outdoors(generator: np.random.Generator) -> Scene:
    """Draw a place without walls: what `random_room` has, over a wider area, and only some of the walls' remains."""
    scene = random_room(generator, size=(8.0, 24.0), pieces=20)
    kept = generator.random(len(scene.polygons)) < 0.6
    return Scene(polygons=tuple(p for p, k in zip(scene.polygons, kept, strict=True) if k), cylinders=scene.cylinders)
