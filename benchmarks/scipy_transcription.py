"""A straightforward transcription of Eqs. 2–9 with SciPy, as a scientific script would have it; N = 1 and 2 only.

The person's problem (Eq. 2) is solved by SLSQP from a zero start for every cell, awareness and step of the prediction
and rounded to the nearest action; the robot's problem (Eq. 9) by SLSQP with a distance constraint to every likely cell.
"""

from __future__ import annotations

import sys
from time import perf_counter

import numpy as np
from scipy.optimize import minimize

STEP, SPEED, REACH = 0.5, 0.5, 2
LEVELS = SPEED * np.arange(-REACH, REACH + 1)
ACTIONS = np.array([(a, b) for a in LEVELS for b in LEVELS])
GOAL_H, GOAL_R = np.array([5.0, 0.0]), np.array([0.0, 10.0])
TH1, TH2, TH3, TH4, TH5, TH6 = 2.5, 8.0, 100.0, 0.06, 1.0, 1.0
OMEGA, LIMIT, CLEARANCE = 0.2, 0.05, 0.5


def human_action(x, robot, beta, n):
    def cost(flat):
        u, y, total = flat.reshape(n, 2), np.array(x), 0.0
        for k in range(n):
            y = y + STEP * u[k]
            total += TH1 * ((y - GOAL_H) ** 2).sum() + TH2 * (u[k] ** 2).sum()
            total += beta * TH3 * np.exp(-TH4 * ((y - robot[min(k + 1, len(robot) - 1)]) ** 2).sum())
        return total

    best = minimize(cost, np.zeros(2 * n), bounds=[(LEVELS[0], LEVELS[-1])] * (2 * n), method="SLSQP").x[:2]
    return int(((ACTIONS - best) ** 2).sum(axis=1).argmin())


def predict(x, robot, belief, n):
    mass, steps = {tuple(np.round(x, 6)): 1.0}, []
    for k in range(n):
        after: dict = {}
        for cell, p in mass.items():
            for beta, weight in ((1, belief), (0, 1 - belief)):
                chosen = human_action(np.array(cell), robot[k:], beta, n)
                for a, u in enumerate(ACTIONS):
                    share = (1 - OMEGA) * (a == chosen) + OMEGA / len(ACTIONS)
                    key = tuple(np.round(np.array(cell) + STEP * u, 6))
                    after[key] = after.get(key, 0.0) + p * weight * share
        mass = after
        steps.append(mass)
    return steps


def plan(robot, person, belief, n):
    guess = np.array([robot + STEP * min(k, n) * np.array([0.0, 1.0]) for k in range(2 * n + 2)])
    seen = predict(person, guess, belief, n)

    def path(flat):
        return robot + STEP * np.cumsum(flat.reshape(n, 2), axis=0)

    def cost(flat):
        return TH5 * ((path(flat) - GOAL_R) ** 2).sum() + TH6 * (flat**2).sum()

    def margins(flat):
        x = path(flat)
        gaps = [np.linalg.norm(x[k] - c) - CLEARANCE for k in range(n) for c, p in seen[k].items() if p >= LIMIT]
        return np.array(gaps) if gaps else np.ones(1)

    return minimize(cost, np.zeros(2 * n), bounds=[(-2, 2)] * (2 * n), constraints={"type": "ineq", "fun": margins}).x[
        :2
    ]


def seconds_per_step(n: int) -> float:
    """One planning step, robot and person 3 m from the crossing."""
    began = perf_counter()
    plan(np.array([0.0, -3.0]), np.array([-3.0, 0.0]), 0.5, n)
    return perf_counter() - began


if __name__ == "__main__":
    print(seconds_per_step(int(sys.argv[1])))
