"""What everybody will do if the robot moves along a path: one prediction per person, and the risk they add up to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from threading import Lock

import numpy as np

from sidestep._kernels.evidence import mixed
from sidestep.crew import Crew
from sidestep.human.goals import DirectionGoal, Goal, PointGoal, SlowingGoal
from sidestep.lazily import lazy
from sidestep.planning.plan import PersonPlan
from sidestep.planning.settings import FIRST_STEP_MARGIN
from sidestep.prediction.collision import RiskField
from sidestep.prediction.first_step import FirstStep
from sidestep.prediction.occupancy import Occupancy, Prediction, Workspace
from sidestep.subjects import Circumstances, Subject
from sidestep.types import FloatArray, IntArray, Path, Vector, sealed

_SAME = 1e-6  # m; motions closer than this induce the same prediction


@dataclass(frozen=True, kw_only=True, eq=False)
class Forecast:
    """What everybody will do if the robot moves along `path`.

    Attributes:
        path: (≥ N+1, d) m, of the robot, instant 0 first.
        around: circumstances.
        everybody: who counts.
        predictions: of those who matter, by id.
    """

    path: Path
    around: Circumstances
    everybody: tuple[Subject, ...]
    predictions: Mapping[str, Prediction]

    def foretells(self, path: Path) -> bool:
        """Whether this is what people will do if the robot moves along `path` (N+1, d) m."""
        apart: list[float] = (self.path[: len(path)] - path).ravel().tolist()
        return all(abs(x) < _SAME for x in apart)

    @lazy
    def near(self) -> tuple[Subject, ...]:
        """Those who can come close within the horizon."""
        return tuple(s for s in self.everybody if s.mind.id in self.predictions)

    @lazy
    def field(self) -> RiskField:
        """P(somebody within clearance) at any place and half instant."""
        return RiskField(
            people=[s.mass(self.predictions[s.mind.id]) for s in self.near],
            distances=np.array([s.clearance for s in self.near]),
            midway=self.around.midway,
        )

    @lazy
    def contact(self) -> FloatArray:
        """(N,) P(first contact with anybody at k) along `path`: one contact is the first, so all add up to ≤ 1."""
        none = np.ones(self.around.horizon + 1)  # P(nobody was touched until k)
        for subject in self.near:
            none[1:] *= np.maximum(1.0 - np.cumsum(self.predictions[subject.mind.id].contact), 0.0)
        return none[:-1] - none[1:]

    def expectations(self) -> list[tuple[FloatArray, FloatArray] | None]:
        """Return for everybody the action probabilities (G, 2, n) and velocities (n, d) m/s now, None if far away."""
        found = [self.predictions.get(s.mind.id) for s in self.everybody]
        return [None if p is None else (p.action_probabilities, p.velocities) for p in found]

    @lazy
    def first_step(self) -> FirstStep | None:
        """The risk until the next call, or None where it is not limited or nobody is near."""
        around = self.around
        if around.first_step_limit is None or not self.near:
            return None
        minds = [s.mind for s in self.near]
        told = [self.predictions[m.id] for m in minds]
        counts = [len(p.velocities) for p in told]
        return FirstStep(
            positions=np.array([m.position for m in minds]),
            sigmas=np.array([s.position_sigma for s in self.near]),
            person=_numbered(tuple(counts)),
            velocities=_joined([p.velocities for p in told]),
            probabilities=_joined(
                [mixed(m.belief.weights, p.action_probabilities) for m, p in zip(minds, told, strict=True)]
            ),
            distances=np.array([s.contact + FIRST_STEP_MARGIN for s in self.near]),
            interval=around.interval,
            limit=around.first_step_limit,
        )


@lru_cache(maxsize=64)
def _numbered(counts: tuple[int, ...]) -> IntArray:
    """0, 0, …, 1, 1, …: each number as often as `counts` says."""
    numbers = np.repeat(np.arange(len(counts)), counts)
    numbers.setflags(write=False)
    return numbers


def _joined(arrays: Sequence[FloatArray]) -> FloatArray:
    return sealed(arrays[0] if len(arrays) == 1 else np.concatenate(arrays))


def foresee(
    everybody: tuple[Subject, ...], path: Path, around: Circumstances, crew: Crew, check: Callable[[], object]
) -> Forecast:
    """Predict everybody who matters, under the robot motion `path` ((≥ N + M + 1, d) m); `check` before each."""

    def predicted(subject: Subject, workspace: Workspace) -> Prediction:
        check()
        return subject.predicted(path, workspace)

    near = [subject for subject in everybody if subject.matters(path[0])]
    predictions = {s.mind.id: p for s, p in zip(near, crew.each(predicted, near), strict=True)}
    return Forecast(path=path, around=around, everybody=everybody, predictions=predictions)


class Afterwards:
    """Predicts people who did not matter to a plan, when somebody asks for them: later, and from whatever thread."""

    def __init__(self) -> None:
        self._workspace = Workspace()
        self._busy = Lock()

    def __reduce__(self) -> tuple[type[Afterwards], tuple[()]]:
        return type(self), ()  # nothing is known here that a copy would need

    def occupancy(self, subject: Subject, path: Path) -> Occupancy:
        """Where they will be if the robot moves along `path`."""
        with self._busy:
            return subject.predicted(path, self._workspace).occupancy


def person_plan(subject: Subject, seen: Forecast, afterwards: Afterwards) -> PersonPlan:
    """Return what a plan made under `seen` says of one person; whoever is too far away is predicted `afterwards`."""
    mind, spread, path = subject.mind, subject.spread, seen.path
    prediction = seen.predictions.get(mind.id)
    known = None if prediction is None else prediction.occupancy  # a plan is kept; all of `seen` need not be
    return PersonPlan(
        belief=mind.belief.concerned,
        foretell=(lambda: afterwards.occupancy(subject, path)) if known is None else lambda: known,
        collision_probability=np.zeros(seen.around.horizon) if prediction is None else prediction.contact,
        goals=dict(zip(map(_name, mind.goals), mind.belief.goals.tolist(), strict=True)),
        randomness=subject.randomness,
        position=mind.position,
        velocity=mind.velocity,
        spread=None if spread is None else (spread[0], spread[1][::2]),
    )


def _name(goal: Goal) -> str:
    """A goal in a few words."""
    if isinstance(goal, PointGoal):
        return f"at ({_numbers(goal.position)})"
    if isinstance(goal, DirectionGoal):
        return f"along ({_numbers(goal.velocity)}) m/s"
    return "slows down" if isinstance(goal, SlowingGoal) else "stands still"


def _numbers(vector: Vector) -> str:
    return ", ".join([f"{x:.2f}" for x in vector.tolist()])
