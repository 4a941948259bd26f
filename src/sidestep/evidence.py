"""What a person's motion tells: where to (Eq. 8), and whether they mind the robot.

Evidence is weighed against an *anchor*: the instant at which a prediction was last made, the position then, and the
action probabilities under the robot plan that the person could anticipate. While less than one time step has passed
since the anchor, the belief is the anchor's belief times a share of the evidence, so that it depends on the time that
passed and not on the rate of the calls.
"""

from __future__ import annotations

import math

from sidestep import belief as bayes
from sidestep._kernels.evidence import weigh_action
from sidestep.belief import Belief
from sidestep.human.goals import DirectionGoal
from sidestep.human.habits import Habits
from sidestep.human.reaction import Facing
from sidestep.lattice import identity
from sidestep.mind import Mind
from sidestep.types import FloatArray, Vector

_STALE = 3.0  # time steps after which a displacement no longer tells one action
_GOAL_RATE = 0.5  # 1/s, how fast "where to" is forgotten when it is only known as a direction


def concern(mind: Mind, facing: Facing | None, state: Habits | None, time: float) -> float:
    """P(β = 1) by the clearance gained since a collision course; relaxing where there was none of late."""
    model = mind.model
    told = None if facing is None or state is None else facing.log_ratio(state, time)
    if told is None:
        return bayes.relax(
            mind.belief,
            switch_rate=model.switch_rate,
            prior_concerned=model.prior_concerned,
            elapsed=max(time - mind.seen - mind.unseen, 0.0),
        ).concerned
    odds = model.prior_concerned / (1.0 - model.prior_concerned) * math.exp(told)
    return odds / (1.0 + odds)


def weighed(
    mind: Mind, position: Vector, covariance: FloatArray, time: float, time_step: float, *, age: float = 0.0
) -> Belief:
    """Eq. 8 at `time` s for a position `age` s old, against the anchor, after letting awareness change its mind."""
    anchor = mind.anchor
    model = mind.model
    since = mind.seen + mind.unseen if anchor is None else anchor.time + age
    elapsed = max(time - since, 0.0)
    start = mind.belief if anchor is None else anchor.belief
    believed = bayes.relax(start, switch_rate=model.switch_rate, prior_concerned=model.prior_concerned, elapsed=elapsed)
    if anchor is None or not 0 < elapsed <= _STALE * time_step:
        return believed
    moved = position - anchor.position
    doubt = covariance + anchor.covariance + (model.action_noise * elapsed) ** 2 * identity(position.size)
    # by clearance: a displacement tells where to; whether they mind is told otherwise
    joint = weigh_action(
        believed.weights, anchor.probabilities, anchor.velocities, moved, elapsed, doubt,
        min(elapsed / time_step, 1.0), mind.by_clearance,
    )  # fmt: skip
    believed = bayes.believed(joint)
    if mind.habits is not None and isinstance(mind.goals[0], DirectionGoal):
        believed = bayes.relax_goals(believed, mind.habits.modes, _GOAL_RATE, elapsed)
    return believed
