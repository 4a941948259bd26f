"""Everything that is assumed about a person, in one frozen value."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from sidestep.checks import FARTHEST, MOST_REACH, WIDEST, Checks, numbers_in
from sidestep.human.habit_settings import HabitSettings
from sidestep.human.reaction import ReactionSettings
from sidestep.types import AwarenessOverHorizon, DangerDecay, Evidence, Frame, GoalCost


@dataclass(frozen=True, slots=True, kw_only=True)
class HumanModel:
    """How a person decides (Eq. 2), how random they are (Eq. 4), and how they are measured (Eq. 8).

    The defaults serve real people (direction goals, the person's own frame, what is learned online switched on);
    the scenarios `paper-printed` and `paper-authors` set every field to what the paper and its authors used.

    Attributes:
        walking_speed: m/s, v_H; the step between neighbouring actions in the world frame.
        reach: actions per axis are −reach·v … reach·v, reach from 1 to 10 (the paper: 2).
        horizon: steps, N_H; None takes the planner's horizon, 0 is "no prediction": one step ahead, robot stays put.
        frame: "heading" turns the lattice to the walking direction and scales it to the observed speed
            (2v = observed speed within `speed_range`); "world" keeps the axes and v.
        speed_range: m/s, bounds on the largest action reach·v in the heading frame; whoever is faster is predicted to
            be that fast only.
        goal_cost: "squared" is ‖x−g‖²_θ1 (Eq. 2a); "distance" is θ1·‖x−g‖, whose pull does not grow with distance.
        goal_weight: θ1, one number or one per lattice axis (≥ 0).
        effort_weight: θ2, one number or one per lattice axis (≥ 0).
        danger_weight: θ3 (≥ 0).
        danger_rate: θ4, 1/m for decay "distance", 1/m² for "squared_distance" (≥ 0).
        danger_decay: exp(−θ4·dist) as printed, or exp(−θ4·dist²) as the authors ran it.
        repulsion_weight: as θ3, of being where another person is; 0: people do not mind each other, as in the paper.
        repulsion_rate: as θ4, of the distance to another person; `danger_decay` holds for both.
        perception_noise: m, standard deviation σ of the person's error in judging the distance to the robot.
        randomness: ω_H in [0, 1]; the share of random actions (where `online_randomness`, its starting value).
        rationality: 1/cost; ∞ is Eq. 5, a finite value makes P_d ∝ exp(−rationality·Q).
        awareness_over_horizon: "persistent" propagates P(x|β) apart, "resampled" is Eq. 7 as printed.
        prior_concerned: P_0(β = 1), strictly between 0 and 1.
        switch_rate: 1/s, rate at which β changes; 0 is the paper.
        measurement_noise: m, standard deviation of a measured position, where the observation brings none.
        action_noise: m/s, how far a real velocity strays from the nearest action; 0 is the paper.
        goals: candidate goals, each (d,) m, a sequence or (G, d) array; used where an observation brings none. "exits":
            the openings of the planner's own map (`sidestep.exits`); without any, as with no candidates, directions are
            inferred.
        radius: m, of the person's body (≤ 100).
        motion_filter: filter measured positions and learn habits (the next two fields need it); off in the paper.
        steadiness: learn online how steadily each person walks, and spread the prediction accordingly.
        online_randomness: learn ω online from how often the velocity changes.
        habits: constants of what is learned online; fitted to tracks by `sidestep fit`.
        evidence: what tells β of people whose goal is not known. "action": the last action (Eq. 8), as of everybody
            else; "clearance": by how much they gained clearance since they were on a collision course (needs the
            `motion_filter`): a person who has turned already keeps the new direction whatever β is, so that their last
            action alone says next to nothing.
        reaction: constants of the evidence "clearance".
    """

    walking_speed: float = 0.5
    reach: int = 2
    horizon: int | None = None
    frame: Frame = "heading"
    speed_range: tuple[float, float] = (1.0, 6.0)
    goal_cost: GoalCost = "distance"
    goal_weight: float | tuple[float, ...] = 1.0
    effort_weight: float | tuple[float, ...] = 0.05
    danger_weight: float = 6.0
    danger_rate: float = 1.0
    danger_decay: DangerDecay = "squared_distance"
    repulsion_weight: float = 0.0
    repulsion_rate: float = 1.0
    perception_noise: float = 0.0
    randomness: float = 0.2
    rationality: float = math.inf
    awareness_over_horizon: AwarenessOverHorizon = "persistent"
    prior_concerned: float = 0.5
    switch_rate: float = 0.05
    measurement_noise: float = 0.03
    action_noise: float = 0.15
    goals: tuple[tuple[float, ...], ...] | Literal["exits"] = ()
    radius: float = 0.3
    motion_filter: bool = True
    steadiness: bool = True
    online_randomness: bool = True
    habits: HabitSettings = field(default_factory=HabitSettings)
    evidence: Evidence = "clearance"
    reaction: ReactionSettings = field(default_factory=ReactionSettings)

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    @property
    def candidates(self) -> tuple[tuple[float, ...], ...]:
        """Candidate goals that are places already, each (d,) m."""
        return () if isinstance(self.goals, str) else self.goals

    def __post_init__(self) -> None:
        check = Checks(self, "human")
        check.numbers("walking_speed", above=0.0, unit="m/s")
        check.integers("reach", least=1, most=MOST_REACH)
        check.integers("horizon", least=0, most=FARTHEST, optional=True, mend="none is the planner's horizon")
        check.words("frame", Frame)
        low, high = check.listed("speed_range", count=2, above=0.0)
        if low > high:
            raise check.wrong("speed_range", "0 < low ≤ high (m/s)")
        check.words("goal_cost", GoalCost)
        check.weights("goal_weight", "effort_weight")
        check.numbers("danger_weight", "danger_rate", "repulsion_weight", "repulsion_rate", least=0.0)
        check.words("danger_decay", DangerDecay)
        check.numbers("perception_noise", "measurement_noise", least=0.0, unit="m")
        check.numbers("randomness", least=0.0, most=1.0)
        if not (isinstance(self.rationality, float) and self.rationality == math.inf):
            check.numbers("rationality", above=0.0, unit="or inf")
        check.words("awareness_over_horizon", AwarenessOverHorizon)
        check.numbers("prior_concerned", above=0.0, below=1.0)
        check.numbers("switch_rate", least=0.0, unit="1/s")
        check.numbers("action_noise", least=0.0, unit="m/s")
        object.__setattr__(self, "goals", _goals(self.goals, check))
        check.numbers("radius", above=0.0, most=WIDEST, unit="m")
        check.flags("motion_filter", "steadiness", "online_randomness")
        check.kind("habits", HabitSettings)
        check.words("evidence", Evidence)
        check.kind("reaction", ReactionSettings)


def _goals(given: object, check: Checks) -> tuple[tuple[float, ...], ...] | Literal["exits"]:
    """Candidate goals as tuples."""
    if isinstance(given, str) and given == "exits":
        return "exits"
    places = tuple(map(numbers_in, given)) if isinstance(given, Iterable) and not isinstance(given, str) else ((),)
    if not all(len(place) in (1, 2, 3) and len(place) == len(places[0]) for place in places):
        raise check.wrong("goals", "places of 1, 2 or 3 finite numbers (m, up to 1e9), all of as many; or exits")
    return places
