"""One person, one robot path, several hypotheses: laid out for the kernels, swept, pushed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sidestep._kernels.push_evenly import add_midway
from sidestep._kernels.push_horizon import Behaviour, Conditions, propagate
from sidestep._kernels.push_sections import contact_shares
from sidestep._kernels.sweep_choices import Choices
from sidestep.errors import InvalidInput
from sidestep.human.cost import danger_terms
from sidestep.human.intent import Intent
from sidestep.human.policy import GoalPolicy, policy_of, undisturbed, words_of
from sidestep.prediction.ground import Ground
from sidestep.prediction.profiles import Profile, profile_of
from sidestep.prediction.workspace import Constants, Results, Workspace
from sidestep.types import FloatArray, IntArray

LARGEST_ODDS = 8_000_000
"""Probabilities of a finite rationality that are held at a time (64 MB)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Removal:
    """Mass that touches the robot at instant k is taken out before k + 1 (first passage).

    Attributes:
        distance: m between centres; contact is anything nearer.
        weights: (C,) of the Gaussians that spread the person's position around the lattice, or None: nothing does.
        sigmas: (N+1, C) m, their standard deviations at k = 0..N; the share removed is then P(nearer than `distance`).
        profile: of `profile_of` for these, where it is known already.
    """

    distance: float
    weights: FloatArray | None = None
    sigmas: FloatArray | None = None
    profile: Profile | None = None


_NO_ACTIONS = np.zeros(0)
_NOT_SPREAD = np.zeros((1, 0)), np.zeros((1, 4))


class Scene:
    """One person, one robot path, several goals; everything laid out for the kernels."""

    def __init__(
        self, ground: Ground, policies: list[GoalPolicy], given: Conditions, space: Workspace, constants: Constants
    ) -> None:
        self.given = given
        self._ground = ground
        self._policies = policies
        self._space = space
        self._constants = constants
        self._swept: tuple[int, int, int, bool] | None = None
        self._behaviour: Behaviour | None = None

    @classmethod
    def of(
        cls,
        ground: Ground,
        robot_path: FloatArray,
        removal: Removal | None,
        space: Workspace,
        randomness: float | None = None,
        others: FloatArray | None = None,
        midway: bool = False,
    ) -> Scene:
        """Lay out what the robot changes; arguments as for `predict`."""
        grid, model, horizon = ground.grid, ground.model, ground.horizon
        world = np.ascontiguousarray(robot_path, dtype=np.float64)
        needed = max(horizon + 1, horizon + ground.lead * grid.steps)
        if world.ndim != 2 or world.shape[1] != grid.dimension or len(world) < needed:
            raise InvalidInput("robot_path", world.shape, f"at least ({needed}, {grid.dimension})")
        company = None if others is None else others[:, :needed]
        danger = danger_terms(model, world[:needed], grid, horizon, ground.lead, others=company)
        constants = space.constants(grid.reach, horizon, grid.dimension)
        policies = [policy_of(intent, danger) for intent in ground.intents]
        random = model.randomness if randomness is None else randomness
        given = _conditions(random, ground, danger.path, removal, midway, constants)
        return cls(ground, policies, given, space, constants)

    @property
    def offsets(self) -> IntArray:
        """(2N+2,) where the blocks at half instants begin; those of mid-steps are empty unless they are wanted."""
        return self.given.offsets

    @property
    def radii(self) -> IntArray:
        """(2N+1,) cells from the anchor to the faces of each block."""
        return self._constants.radii

    def push(
        self, goal: int, weight: float, concerned: float, results: Results, actions: FloatArray | None = None
    ) -> None:
        """Add one hypothesis to the results, as many policies at a time as fit; `actions`: see `propagate`."""
        for first, last in self._stretches(self._ground.intents[goal]):
            self._propagate(goal, first, last, weight, concerned, results, actions)

    def add_midway(self, blocks: FloatArray) -> None:
        """Add to the mid-steps, once all hypotheses are in, what moves at random."""
        given, own = self.given, self._constants
        add_midway(
            blocks, given.offsets, given.reach, given.dimension, given.randomness, given.walls, given.middle,
            own.scratch, own.line,
        )  # fmt: skip

    def unmoved(self, goal: int) -> bool:
        """Whether the robot provably changes nothing that a person with this goal does."""
        return not any(self._policies[goal].differs.tolist())

    def first_actions(self, goal: int, beta: float, actions: FloatArray) -> None:
        """Write P(u | x; goal, β) at the anchor now into `actions` (n,)."""
        self._propagate(goal, 0, 1, 1.0, beta, self._constants.nowhere, actions)

    def _propagate(
        self,
        goal: int,
        first: int,
        last: int,
        weight: float,
        concerned: float,
        results: Results,
        actions: FloatArray | None,
    ) -> None:
        own, behaviour = self._constants, self._behave(goal, first, last, concerned > 0)
        calm, minding = behaviour.undisturbed, behaviour.concerned
        propagate(
            behaviour.mixture, behaviour.tables, behaviour.used, behaviour.differs, calm.words, calm.radii,
            calm.offsets, calm.masks, calm.odds, minding.radii, minding.offsets, minding.masks, minding.odds,
            *self.given, first, last, weight, concerned, own.field, own.scratch, own.line, own.lost, results.blocks,
            results.contact, _NO_ACTIONS if actions is None else actions,
        )  # fmt: skip

    def _behave(self, goal: int, first: int, last: int, minding: bool) -> Behaviour:
        """Sweep what is needed of one goal's policies first ≤ k < last, unless the last thing swept covers it."""
        if self._behaviour is None or not self._covered(goal, first, last, minding):
            policy = self._policies[goal]
            intent = policy.intent
            self._swept = (goal, first, last, minding)
            self._behaviour = Behaviour(
                intent.actions.mixture,
                intent.tables,
                intent.used,
                self._undisturbed(goal, last),
                self._concerned(policy, first, last) if minding else self._constants.nobody,
                policy.differs,
            )
        return self._behaviour

    def _covered(self, goal: int, first: int, last: int, minding: bool) -> bool:
        if self._swept is None:
            return False
        known, begin, end, heeded = self._swept
        return goal == known and begin <= first and last <= end and heeded >= minding

    def _concerned(self, policy: GoalPolicy, first: int, last: int) -> Choices:
        if not any(policy.differs[first:last].tolist()):
            return self._constants.nobody
        ground = self._ground
        radii = [ground.grid.reach * k for k in range(ground.horizon)]
        choices = self._room(policy.intent, radii, first, last)
        if policy.felt_near_by and (first, last) == (0, ground.horizon):
            scratch = self._space.near(ground.grid, ground.horizon, choices.masks.shape[0])
            if policy.sweep_near(ground.lead, scratch, choices):
                return choices
        policy.sweep(True, first, last, ground.lead, policy.differs, self._space.values(ground.grid), choices)
        return choices

    def _undisturbed(self, goal: int, last: int) -> Choices:
        intent = self._ground.intents[goal]
        if intent.tables.size > 0:
            return self._constants.nobody
        if math.isinf(intent.rationality):
            return self._ground.calm(goal, self._space)
        room = self._room(intent, [intent.grid.reach * (last - 1)], 0, 1)
        return undisturbed(intent, self._ground.horizon, self._space.values(intent.grid), room)

    def _room(self, intent: Intent, radii: list[int], first: int, last: int) -> Choices:
        """Masks from the workspace, or odds for the policies first ≤ k < last alone."""
        d, reach = intent.grid.dimension, intent.grid.reach
        words = words_of(reach, d)
        if math.isinf(intent.rationality):
            return self._space.choices(radii, d, words, intent.layers)
        sizes = [(2 * r + 1) ** d if first <= k < last else 0 for k, r in enumerate(radii)]
        ends = np.cumsum(np.array(sizes, dtype=np.int64))
        odds = np.zeros(((2 * reach + 1) ** d, int(ends[-1])))
        return Choices(np.array(radii), ends - sizes, words, np.zeros((words, 0), np.int64), odds)

    def _stretches(self, intent: Intent) -> list[tuple[int, int]]:
        horizon = self._ground.horizon
        if math.isinf(intent.rationality):
            return [(0, horizon)]
        reach, d = self.given.reach, self.given.dimension
        cells = (2 * reach * np.arange(horizon) + 1) ** d
        part = np.cumsum(cells) * (2 * reach + 1) ** d // LARGEST_ODDS
        starts = [int(k) for k in np.flatnonzero(np.diff(part, prepend=-1))]
        return list(zip(starts, [*starts[1:], horizon], strict=True))


def _conditions(
    randomness: float, ground: Ground, path: FloatArray, removal: Removal | None, midway: bool, constants: Constants
) -> Conditions:
    grid, horizon = ground.grid, ground.horizon
    reach = grid.reach
    middle = reach * (horizon - 1)
    boxes = np.empty((0 if removal is None else horizon + 1, 7), np.int64)
    if removal is not None:
        samples, grids = _contact_profiles(removal, horizon, grid.dimension)
        contact_shares(
            path, grid.lattice.spacing, reach, grid.dimension, float(removal.distance), samples, grids, boxes,
            constants.shares,
        )  # fmt: skip
    return Conditions(
        dimension=grid.dimension,
        reach=reach,
        randomness=float(randomness),
        walls=constants.nobody.masks if ground.random is None else ground.random,
        centre=reach * horizon,
        middle=middle,
        boxes=boxes,
        shares=constants.shares,
        offsets=constants.offsets if midway else constants.step_offsets,
        midway=midway,
    )


def _contact_profiles(removal: Removal, horizon: int, dimension: int) -> Profile:
    if removal.weights is None or removal.sigmas is None:
        return _NOT_SPREAD
    sigmas = np.ascontiguousarray(removal.sigmas, dtype=np.float64)
    weights = np.ascontiguousarray(removal.weights, dtype=np.float64)
    if weights.ndim != 1 or sigmas.shape != (horizon + 1, weights.size):
        raise InvalidInput("removal.sigmas", sigmas.shape, f"({horizon + 1}, {weights.size})")
    if removal.profile is not None:
        return removal.profile
    return profile_of(float(removal.distance), weights, sigmas, dimension)
