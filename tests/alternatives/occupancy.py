"""Eqs. 4, 6, 7 by enumeration of every behaviour of the person: (awareness, actions) step by step, in a dictionary."""

import itertools
from collections import defaultdict
from dataclasses import replace

import numpy as np

from alternatives.policy import action_probabilities


def enumerate_behaviours(model, lattice, goals, weights, robot_path, horizon, time_step, removal=None, free=None):
    """Every (goal, β, u_0, …, u_{N−1}) with its probability, each followed from the anchor by itself.

    Returns:
        masses: N + 1 dicts, cell → probability at k; halves: N dicts, doubled cell → probability at k + ½;
        contact: (N,) first-passage probability.
    """
    d, reach = lattice.dimension, model.reach
    prediction = model.horizon if model.horizon is not None else horizon
    model = replace(model, horizon=prediction)
    actions = list(itertools.product(range(-reach, reach + 1), repeat=d))
    known = {}

    def probabilities(k, cell, goal, beta):
        key = (k, cell, goal, beta)
        if key not in known:
            chosen = action_probabilities(
                model, lattice, goals[goal], robot_path[k:], beta, time_step, np.array(cell), free
            )
            admissible = np.array([_is_free(free, np.add(cell, u)) for u in actions], dtype=float)
            if not admissible.any():
                admissible[len(actions) // 2] = 1.0
            known[key] = (1 - model.randomness) * chosen + model.randomness * admissible / admissible.sum()
        return known[key]

    masses = [defaultdict(float) for _ in range(horizon + 1)]
    halves = [defaultdict(float) for _ in range(horizon)]
    contact = np.zeros(horizon)

    def follow(k, cell, goal, weight_by_beta, alive):
        """weight_by_beta: (2,) joint mass of this history with each awareness."""
        total = sum(weight_by_beta)
        if k > 0 and removal is not None and alive:
            position = lattice.to_world(np.array(cell) * lattice.spacing)
            if np.linalg.norm(position - robot_path[k]) < removal.distance:
                contact[k - 1] += total
                alive = False
        masses[k][cell] += total
        if k == horizon:
            return
        both = [
            probabilities(k, cell, goal, beta) if weight_by_beta[beta] > 0 else np.zeros(len(actions))
            for beta in (0, 1)
        ]
        for index, action in enumerate(actions):
            after = [weight_by_beta[beta] * both[beta][index] for beta in (0, 1)]
            if sum(after) == 0:
                continue
            if model.awareness_over_horizon == "resampled":
                share = np.array(weights[goal]) / sum(weights[goal])
                after = list(sum(after) * share)
            halves[k][tuple(2 * np.array(cell) + action)] += sum(after)
            follow(k + 1, tuple(np.add(cell, action)), goal, after, alive)

    for goal, pair in enumerate(weights):
        if sum(pair) > 0:
            follow(0, (0,) * d, goal, list(pair), True)
    return masses, halves, contact


def dense(mass, radius, dimension):
    """Dict of cells → array over a box."""
    array = np.zeros((2 * radius + 1,) * dimension)
    for cell, value in mass.items():
        array[tuple(np.array(cell) + radius)] += value
    return array


def _is_free(free, cell):
    if free is None:
        return True
    radius = free.shape[0] // 2
    if np.any(np.abs(cell) > radius):
        return True
    return bool(free[tuple(np.asarray(cell) + radius)])
