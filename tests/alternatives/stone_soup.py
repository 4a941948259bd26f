"""Stone Soup's global nearest neighbour tracker on our detections, and its CLEAR MOT: oracles."""

from __future__ import annotations

import datetime

import numpy as np

from sidestep.human.observation import PersonObservation
from sidestep.perception.association import pair_legs
from sidestep.perception.legs import find_legs

_BEGIN = datetime.datetime(2020, 1, 1)
_PATIENCE = 0.9  # s
_HITS = 4  # before a track is reported


class GnnTracker:
    """Constant-velocity Kalman filters and a 2-D assignment: pairs of legs, and single ones, are the detections.

    `likely` is the log likelihood ratio from which a cluster counts as a leg.
    """

    def __init__(self, classifier, likely, *, agility=2.5, deviation=0.1, gate=3.0):
        from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
        from stonesoup.hypothesiser.distance import DistanceHypothesiser
        from stonesoup.measures import Mahalanobis
        from stonesoup.models.measurement.linear import LinearGaussian
        from stonesoup.models.transition.linear import CombinedLinearGaussianTransitionModel, ConstantVelocity
        from stonesoup.predictor.kalman import KalmanPredictor
        from stonesoup.updater.kalman import KalmanUpdater

        motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(agility), ConstantVelocity(agility)])
        self.measurement = LinearGaussian(4, mapping=(0, 2), noise_covar=deviation**2 * np.eye(2))
        self.predictor, self.updater = KalmanPredictor(motion), KalmanUpdater(self.measurement)
        hypotheses = DistanceHypothesiser(self.predictor, self.updater, Mahalanobis(), missed_distance=gate)
        self.associator = GNNWith2DAssignment(hypotheses)
        self.classifier, self.likely = classifier, likely
        self.tracks, self.begin, self.scan = set(), None, None

    def update(self, scan):
        from stonesoup.types.detection import Detection
        from stonesoup.types.state import GaussianState
        from stonesoup.types.track import Track
        from stonesoup.types.update import Update

        self.begin = scan.time if self.begin is None else self.begin
        now = _BEGIN + datetime.timedelta(seconds=scan.time - self.begin)
        detections = {
            Detection(place.reshape(2, 1), timestamp=now, measurement_model=self.measurement)
            for place in self._places(scan)
        }
        free = set(detections)
        if self.tracks and detections:
            found = self.associator.associate(self.tracks, detections, now)
            for track, hypothesis in found.items():
                if hypothesis:
                    track.append(self.updater.update(hypothesis))
                    free.discard(hypothesis.measurement)
                else:
                    track.append(hypothesis.prediction)
        else:
            for track in self.tracks:
                track.append(self.predictor.predict(track.state, timestamp=now))
        self.tracks = {t for t in self.tracks if (now - _last_seen(t)).total_seconds() <= _PATIENCE}
        for detection in free:
            x, y = np.asarray(detection.state_vector, dtype=float).ravel()
            prior = GaussianState([[x], [0.0], [y], [0.0]], np.diag([0.01, 1.0, 0.01, 1.0]), timestamp=now)
            track = Track([prior])
            track.metadata["seen"] = now
            self.tracks.add(track)
        reported = [t for t in self.tracks if sum(isinstance(s, Update) for s in t.states) >= _HITS]
        return [_observation(track) for track in reported]

    def _places(self, scan):
        legs = find_legs(scan, self.classifier, nearest=0.25)
        pairs = pair_legs(legs, legs.leg, legs.leg > self.likely)
        return [(legs.positions[i] + legs.positions[j if j >= 0 else i]) / 2 for i, j in pairs]


def _last_seen(track):
    from stonesoup.types.update import Update

    return next((s.timestamp for s in reversed(track.states) if isinstance(s, Update)), track.states[0].timestamp)


def _observation(track):
    x, vx, y, vy = np.asarray(track.state.mean, dtype=float).ravel()
    return PersonObservation(id=track.id, position=(x, y), velocity=(vx, vy))


def clear_mot(people, tracks, *, distance):
    """(MOTP, MOTA) of {id: {step: place}} by Stone Soup."""
    from stonesoup.dataassociator.clearmot import ClearMotAssociator
    from stonesoup.measures import Euclidean
    from stonesoup.metricgenerator.clearmotmetrics import ClearMotMetrics
    from stonesoup.metricgenerator.manager import MultiManager
    from stonesoup.types.groundtruth import GroundTruthPath, GroundTruthState
    from stonesoup.types.state import State
    from stonesoup.types.track import Track

    def states(path, kind):
        return [kind(np.reshape(p, (2, 1)), timestamp=_BEGIN + datetime.timedelta(seconds=k)) for k, p in path.items()]

    measure = Euclidean(mapping=[0, 1])
    generator = ClearMotMetrics(distance_measure=measure)
    manager = MultiManager([generator], associator=ClearMotAssociator(measure=measure, association_threshold=distance))
    manager.add_data(
        {
            "groundtruth_paths": {GroundTruthPath(states(path, GroundTruthState)) for path in people.values()},
            "tracks": {Track(states(path, State)) for path in tracks.values()},
        }
    )
    metrics = manager.generate_metrics()["clearmot_generator"]
    return metrics["MOTP"].value, metrics["MOTA"].value
