"""One person laid out for prediction: everything about them that the robot's motion does not change, computed once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sidestep.lattice import Lattice
from sidestep.lazily import lazy
from sidestep.mind import Mind
from sidestep.obstacles import Obstacles
from sidestep.planning.settings import CLEARANCE_MARGIN, FIRST_STEP_MARGIN
from sidestep.prediction.collision import PersonMass
from sidestep.prediction.ground import Ground
from sidestep.prediction.occupancy import Prediction, Removal, Workspace, frame_of, predict_on
from sidestep.prediction.profiles import Profile, profile_of
from sidestep.types import BoolArray, FloatArray, Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Circumstances:
    """What holds for everybody.

    Attributes:
        time_step: s; horizon: steps; robot_radius: m; robot_speed: m/s, its largest in any direction.
        clearance: m between centres, or None: contact + 0.10 m.
        midway: look between the steps too; first_step_limit: see `PlannerSettings`; interval: s until the next call.
        obstacles: walls that people do not pass, or None.
        least_randomness: see `PlannerSettings`.
    """

    time_step: float
    horizon: int
    robot_radius: float
    interval: float
    robot_speed: float = 0.0
    clearance: float | None = None
    midway: bool = False
    first_step_limit: float | None = None
    obstacles: Obstacles | None = None
    least_randomness: float = 0.0


@dataclass(frozen=True, eq=False)
class Subject:
    """A person under these circumstances.

    Attributes:
        mind: what is known of the person.
        around: what holds for everybody.
        others: the other people, where this one minds them.
    """

    mind: Mind
    around: Circumstances
    others: tuple[Mind, ...] = ()

    @property
    def contact(self) -> float:
        """Metres between centres at which bodies touch."""
        return self.around.robot_radius + self.mind.model.radius

    @property
    def clearance(self) -> float:
        """Metres between centres that are to be kept."""
        return self.contact + CLEARANCE_MARGIN if self.around.clearance is None else self.around.clearance

    @property
    def look_ahead(self) -> int:
        """Steps that this person looks ahead, M."""
        own = self.mind.model.horizon
        return max(self.around.horizon if own is None else own, 1)

    @lazy
    def position_sigma(self) -> float:
        """Metres, standard deviation of the measured position per axis."""
        return math.sqrt(float(self.mind.position_covariance.trace()) / self.mind.position.size)

    @lazy
    def lattice(self) -> Lattice:
        """Cells on which the person's actions land."""
        mind = self.mind
        return frame_of(mind.model, mind.position, mind.heading_velocity, self.around.time_step)

    @property
    def randomness(self) -> float:
        """ω, as it was found to be, or as is planned for at least."""
        mind = self.mind
        if mind.habits is None or not mind.model.online_randomness:
            return mind.model.randomness
        return max(mind.randomness, self.around.least_randomness)

    @lazy
    def free(self) -> BoolArray | None:
        """(cells…) where the person may be; None: everywhere that can be reached."""
        if self.around.obstacles is None:
            return None
        cells = self.lattice.with_radius(self.mind.model.reach * (self.around.horizon + self.look_ahead))
        free = self.around.obstacles.free_cells(cells, margin=0.5 * self.mind.model.radius)
        return None if free.all() else free  # walls out of reach would only keep costs from being summed axis by axis

    @lazy
    def spread(self) -> tuple[FloatArray, FloatArray] | None:
        """Weights (C,), sigmas (2N+1, C) m of the Gaussians around every cell at half instants; None: none."""
        return self.mind.spread(np.arange(2.0 * self.around.horizon + 1.0) * (0.5 * self.around.time_step))

    @lazy
    def removal(self) -> Removal:
        """Contact, of the person as spread out as their habits say."""
        if self.spread is None:
            return Removal(distance=self.contact)
        weights, sigmas = self.spread
        at_steps = np.ascontiguousarray(sigmas[::2])
        profile = profile_of(self.contact, weights, at_steps, self.mind.position.size)
        return Removal(distance=self.contact, weights=weights, sigmas=at_steps, profile=profile)

    @lazy
    def profile(self) -> Profile | None:
        """P(nearer than the clearance | distance to the cell) at half instants."""
        if self.spread is None:
            return None
        return profile_of(self.clearance, *self.spread, self.mind.position.size)

    @lazy
    def ground(self) -> Ground:
        """Cells, walls and goals, the same for all predictions of this person at this time."""
        mind, around = self.mind, self.around
        return Ground.of(mind.model, self.lattice, mind.goals, around.horizon, around.time_step, self.free)

    @lazy
    def reach(self) -> float:
        """Metres from the robot beyond which the two cannot come within clearance during the horizon."""
        around, mind = self.around, self.mind
        time = around.horizon * around.time_step
        walk = mind.model.reach * self.lattice.spacing * around.horizon * math.sqrt(mind.position.size)
        blur = 0.0 if self.spread is None else 5.0 * float(self.spread[1][-1].max())
        return walk + around.robot_speed * time + max(self.clearance, self.contact + FIRST_STEP_MARGIN) + blur

    def matters(self, start: FloatArray) -> bool:
        """Return whether the person can come within clearance of the robot at all during the horizon.

        If not, the risk field is exactly zero wherever the robot can be, and nobody needs to be predicted.
        """
        apart = math.dist(self.mind.position.tolist(), start.tolist())
        return not apart > self.reach  # where that is no number, nobody can tell

    def predicted(self, path: Path, workspace: Workspace) -> Prediction:
        """Predict the person, the robot moving along `path` ((≥ N + M + 1, d) m)."""
        return predict_on(
            self.ground,
            weights=self.mind.belief.weights,
            robot_path=path,
            removal=self.removal,
            randomness=self.randomness,
            midway=self.around.midway,
            workspace=workspace,
            others=self._others_along(len(path)),
        )

    def _others_along(self, instants: int) -> FloatArray | None:
        """(P, instants, d) m, the other people if each goes on at the present velocity; None: nobody is minded."""
        if not self.others:
            return None
        time = self.around.time_step * np.arange(instants)[:, None]
        return np.array([other.position + time * other.velocity for other in self.others])

    def mass(self, prediction: Prediction) -> PersonMass:
        """Return what the risk is computed from."""
        weights, sigmas = (None, None) if self.spread is None else self.spread
        return PersonMass.of_prediction(prediction, weights=weights, sigmas=sigmas, profile=self.profile)


def everybody_of(minds: Sequence[Mind], around: Circumstances) -> tuple[Subject, ...]:
    """Return everybody, each among the others where the model says that they are minded."""
    return tuple(
        Subject(mind, around, tuple(o for o in minds if o is not mind) if mind.model.repulsion_weight > 0 else ())
        for mind in minds
    )
