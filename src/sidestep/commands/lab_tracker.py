"""What `sidestep lab --score` and `--train` do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sidestep.commands.console import emit_json, say, show, table

TRAINING_SCANS, TEST_SCANS = 6000, 500
_TEST_STREAM = 1  # of the generator for the scans that the classifier is judged by


def score(recording: Path, classifier: Path | None, *, json: bool) -> None:
    """Print how well the tracker, and the simplest one, do on a recording."""
    from sidestep.io.scans import read_scan_recording
    from sidestep.perception.classifier import load_classifier
    from sidestep.perception.tracks import Tracker
    from sidestep.studies.tracking import score as score_tracker
    from sidestep.studies.trivial_tracker import TrivialTracker

    scans = read_scan_recording(recording)
    trees = load_classifier(classifier)
    first = scans.scan(0)
    for tracker in (Tracker(classifier=trees), TrivialTracker()):
        tracker.update(first)  # compiles; the figures below are about the second scan and all later ones
    found = score_tracker(scans, Tracker(classifier=trees)).as_dict()
    simplest = score_tracker(scans, TrivialTracker()).as_dict()
    if json:
        emit_json(found | {"trivial": {k: v for k, v in simplest.items() if k not in ("recording", "scans")}})
        return
    show(f"{scans.name}: {len(scans)} scans, people annotated in {found['annotated_scans']}")
    labels = {
        "recall": "recall",
        "precision": "precision (annotated scans)",
        "id_switches": "identity switches",
        "error_m": "mean position error (m)",
        "rmse_m": "root mean square error (m)",
        "false_positives": "reports without an annotated person",
        "tracks": "identities",
        "ms_mean": "ms per scan, mean",
        "ms_p99": "ms per scan, 99th percentile",
    }
    rows = [(text, _short(found[name]), _short(simplest[name])) for name, text in labels.items()]
    table(rows, header=("", "tracker", "trivial tracker"))


def train(path: Path, labelled: tuple[Path, ...], *, seed: int, json: bool) -> None:
    """Train a leg classifier, write it, and print how it does on simulated scans that it has not seen."""
    import numpy as np

    from sidestep.checks import seeded
    from sidestep.errors import InvalidInput
    from sidestep.io.files import ready_for, written
    from sidestep.io.scans import read_scan_recording
    from sidestep.studies.leg_training import confusion, recorded_samples, simulated_samples
    from sidestep.studies.leg_training import train as fit

    seeded("--seed", seed)
    if path.suffix != ".npz":
        raise InvalidInput("--train", str(path), "a file that ends in .npz")
    ready_for(path)
    recordings = [read_scan_recording(file) for file in labelled]
    say(f"simulating {TRAINING_SCANS} scans")
    features, classes = simulated_samples(np.random.default_rng(seed), scans=TRAINING_SCANS)
    if recordings:
        more_features, more_classes = recorded_samples(recordings)
        features, classes = np.concatenate((features, more_features)), np.concatenate((classes, more_classes))
    say(f"training on {len(classes)} clusters (about two minutes)")
    trees = fit(features, classes, seed=seed)
    with written(path) as file:
        trees.save(file)
    unseen = simulated_samples(np.random.default_rng((seed, _TEST_STREAM)), scans=TEST_SCANS)
    result: dict[str, Any] = {
        "classifier": str(path),
        "clusters": len(classes),
        "recordings": [str(file) for file in labelled],
        "nodes": trees.size,
        "held_out": confusion(trees, *unseen),
    }
    if json:
        emit_json(result)
        return
    held_out = result["held_out"]
    rows = [(name, *(f"{share:.3f}" for share in shares.values())) for name, shares in held_out.items()]
    show(f"wrote {path}; of unseen simulated clusters of each kind, the shares judged to be")
    table(rows, header=("", *held_out))


def _short(value: object) -> str:
    return f"{value:.3f}" if isinstance(value, float) else str(value)
