"""Eq. 2 by brute force: every sequence of actions, cost by its definition. Slow, and right by inspection."""

import itertools
import math

import numpy as np

from sidestep.human.goals import DirectionGoal, PointGoal, SlowingGoal, StandGoal


def sequence_costs(model, lattice, goal, robot_path, awareness, time_step, cell, sequences, free=None, others=()):
    """Cost (S,) of each sequence (S, M, d) of integer actions from `cell` ((d,) offset from the anchor)."""
    d = lattice.dimension
    v = lattice.spacing / time_step
    steps = sequences.shape[1]
    cells = np.asarray(cell) + np.cumsum(sequences, axis=1)  # states 1..M
    world = (cells * lattice.spacing) @ lattice.rotation.T + lattice.origin
    theta1 = np.broadcast_to(np.atleast_1d(model.goal_weight).astype(float), (d,))
    theta2 = np.broadcast_to(np.atleast_1d(model.effort_weight).astype(float), (d,))
    cost = np.sum(theta2 * (sequences * v) ** 2, axis=(1, 2))
    if isinstance(goal, PointGoal):
        local = (world - goal.position) @ lattice.rotation
        if model.goal_cost == "squared":
            cost = cost + np.sum(theta1 * local**2, axis=(1, 2))
        else:
            cost = cost + np.sum(np.sqrt(np.sum((theta1 * local) ** 2, axis=2)), axis=1)
    if isinstance(goal, DirectionGoal):
        w = np.clip((goal.velocity @ lattice.rotation) / v, -model.reach, model.reach)
        if np.linalg.norm(w) > 0:
            unit = np.abs(w) / np.linalg.norm(w)
            behind = (
                np.abs(w - sequences) @ (theta1 * unit) * v * time_step
            )  # (S, M), what each action falls short of the intent
            cost = cost + np.sum(np.cumsum(behind, axis=1), axis=1)  # charged at this and all later instants
    if awareness:
        variance = model.perception_noise**2
        for j in range(steps):
            robot = robot_path[0 if model.horizon == 0 else j + 1]
            distance = np.linalg.norm(world[:, j] - robot, axis=1)
            if model.danger_decay == "distance":
                danger = np.exp(-model.danger_rate * distance + model.danger_rate**2 * variance / 2)
            else:
                wide = 1 + 2 * model.danger_rate * variance
                danger = np.exp(-model.danger_rate * distance**2 / wide) / math.sqrt(wide)
            cost = cost + model.danger_weight * danger
            for other in others:
                gap = np.linalg.norm(world[:, j] - other[0 if model.horizon == 0 else j + 1], axis=1)
                power = gap if model.danger_decay == "distance" else gap**2
                cost = cost + model.repulsion_weight * np.exp(-model.repulsion_rate * power)
    if free is not None:
        radius = free.shape[0] // 2
        inside = np.all(np.abs(cells) <= radius, axis=2)
        index = tuple(np.clip(cells, -radius, radius)[..., a] + radius for a in range(d))
        blocked = np.any(inside & ~free[index], axis=1)
        cost = np.where(blocked, np.inf, cost)
    return cost


def all_sequences(reach, dimension, steps):
    """(S, M, d) every sequence; the first action varies slowest."""
    actions = list(itertools.product(range(-reach, reach + 1), repeat=dimension))
    return np.array(list(itertools.product(actions, repeat=steps)), dtype=int)


def action_values(model, lattice, goal, robot_path, awareness, time_step, cell, free=None, others=()):
    """Q (n,): least cost of each first action from `cell`, over everything that may follow."""
    n = (2 * model.reach + 1) ** lattice.dimension
    if isinstance(goal, StandGoal):
        return np.where(np.arange(n) == n // 2, 0.0, np.inf)
    steps = max(model.horizon, 1)
    if isinstance(goal, SlowingGoal):
        goal, awareness = DirectionGoal(mean_pace(goal, steps * time_step)), 0
    sequences = all_sequences(model.reach, lattice.dimension, steps)
    cost = sequence_costs(model, lattice, goal, robot_path, awareness, time_step, cell, sequences, free, others)
    return cost.reshape(n, -1).min(axis=1)


def action_probabilities(model, lattice, goal, robot_path, awareness, time_step, cell, free=None):
    """P_d (n,) over the first actions (Eq. 5 or Boltzmann), direction goals kept on average."""
    if isinstance(goal, SlowingGoal) and free is None:
        return slowing_probabilities(lattice, model.reach, goal, time_step, cell)
    if isinstance(goal, SlowingGoal):
        goal, awareness = DirectionGoal(mean_pace(goal, max(model.horizon, 1) * time_step)), 0
    values = action_values(model, lattice, goal, robot_path, awareness, time_step, cell, free)
    best = values.min()
    n = len(values)
    if not np.isfinite(best):
        return (np.arange(n) == n // 2).astype(float)
    if math.isfinite(model.rationality):
        weight = np.exp(-model.rationality * (values - best))
        return weight / weight.sum()
    chosen = values <= best + 1e-6 * abs(best) + 1e-12
    plain = chosen / chosen.sum()
    if not isinstance(goal, DirectionGoal):
        return plain
    return _kept_on_average(model, lattice, goal, time_step, cell, free, plain)


def mean_pace(goal, duration):
    """Mean velocity over `duration` s of somebody whose velocity falls to 1/e in `goal.time` s."""
    moments = (np.arange(20000) + 0.5) / 20000 * duration
    return goal.velocity * np.exp(-moments / goal.time).mean()


def slowing_probabilities(lattice, reach, goal, time_step, cell):
    """P_d (n,) of somebody who covers the share 1 − e^{−ΔT/time} of what is left of the way at every step."""
    left = (goal.velocity * goal.time) @ lattice.rotation / lattice.spacing - np.asarray(cell)
    mean = np.clip(left * (1 - math.exp(-time_step / goal.time)), -reach, reach)
    actions = itertools.product(range(-reach, reach + 1), repeat=lattice.dimension)
    return np.array([np.prod([max(0.0, 1 - abs(m - u)) for m, u in zip(mean, a, strict=True)]) for a in actions])


def _kept_on_average(model, lattice, goal, time_step, cell, free, plain):
    """Per axis: the undisturbed component stands for the mixture of the neighbours of the intended velocity."""
    d, reach = lattice.dimension, model.reach
    calm = sequence_best_components(model, lattice, goal, time_step)
    w = np.clip((goal.velocity @ lattice.rotation) * time_step / lattice.spacing, -reach, reach)
    actions = list(itertools.product(range(-reach, reach + 1), repeat=d))
    result = np.zeros(len(actions))
    for action, weight in zip(actions, plain, strict=True):
        if weight == 0:
            continue
        options = []
        for a in range(d):
            if action[a] in calm[a]:
                low = min(math.floor(w[a]), reach - 1)
                options.append([(low, low + 1 - w[a]), (low + 1, w[a] - low)])
            else:
                options.append([(action[a], 1.0)])
        targets = [
            (tuple(m for m, _ in combination), math.prod(p for _, p in combination))
            for combination in itertools.product(*options)
        ]
        targets = [(m, p) for m, p in targets if p > 0]
        if free is not None and not all(_is_free(free, np.asarray(cell) + m) for m, _ in targets):
            targets = [(action, 1.0)]
        for m, p in targets:
            result[actions.index(m)] += weight * p
    return result


def sequence_best_components(model, lattice, goal, time_step):
    """Per axis, the components of the first action that are best when there is neither robot nor wall."""
    best = []
    v = lattice.spacing / time_step
    d = lattice.dimension
    w = np.clip((goal.velocity @ lattice.rotation) / v, -model.reach, model.reach)
    norm = np.linalg.norm(w)
    theta1 = np.broadcast_to(np.atleast_1d(model.goal_weight).astype(float), (d,))
    theta2 = np.broadcast_to(np.atleast_1d(model.effort_weight).astype(float), (d,))
    steps = max(model.horizon, 1)
    for a in range(d):
        components = np.arange(-model.reach, model.reach + 1)
        cost = theta2[a] * (components * v) ** 2
        if norm > 0:
            cost = cost + steps * theta1[a] * abs(w[a]) / norm * lattice.spacing * np.abs(w[a] - components)
        best.append({int(m) for m in components[cost <= cost.min() * (1 + 1e-6) + 1e-12]})
    return best


def _is_free(free, cell):
    radius = free.shape[0] // 2
    if np.any(np.abs(cell) > radius):
        return True
    return bool(free[tuple(np.asarray(cell) + radius)])
