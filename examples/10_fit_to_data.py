"""Parameters from data.

How random are people? Watch them and see which ω makes what they did most likely. Here the people
are simulated with a known ω, so that the answer can be checked; with recorded tracks, `sidestep
fit` does more of the same.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep
from sidestep.human.goals import PointGoal
from sidestep.io.scenarios import load_scenario
from sidestep.prediction.occupancy import first_action_probabilities, frame_of

TRUE = 0.3


def likelihoods(record: sidestep.Record, model: sidestep.HumanModel, step: float) -> list[float]:
    """P(what the person did next) at every step of a run."""
    found = []
    horizon = record.plans.shape[1] - 1
    for k in range(len(record.status)):
        lattice = frame_of(model, record.people_positions[k, 0], None, step)
        ahead = np.concatenate([record.plans[k], np.repeat(record.plans[k][-1:], horizon + 2, axis=0)])
        choices = first_action_probabilities(
            model=model, lattice=lattice, goals=[PointGoal(record.people_goals[0])], robot_path=ahead,
            horizon=horizon, time_step=step,
        )[0, 0]  # fmt: skip
        moved = lattice.with_radius(model.reach).to_local(record.people_positions[k + 1, 0]) / lattice.spacing
        index = np.ravel_multi_index(np.rint(moved).astype(int) + model.reach, (2 * model.reach + 1,) * 2)
        found.append(float(choices[index]))
    return found


def main(folder: Path) -> None:
    scenario = load_scenario("paper-authors", ["people.0.kind=unconcerned", f"people.0.randomness={TRUE}"])
    records = [sidestep.simulate(scenario, seed=seed) for seed in range(6)]
    candidates = np.linspace(0.02, 0.8, 40)
    totals = []
    for randomness in candidates:
        model = replace(scenario.human, randomness=float(randomness))
        totals.append(sum(np.log(likelihoods(r, model, scenario.planner.time_step)).sum() for r in records))
    best = candidates[np.argmax(totals)]
    steps = sum(len(r.status) for r in records)
    print(f"{steps} steps of six people: most likely randomness {best:.2f}, true {TRUE}")
    axes = Figure(figsize=(5.5, 3.5), layout="constrained").add_subplot(xlabel="ω", ylabel="log-likelihood")
    axes.plot(candidates, totals, color="#0072B2")
    axes.axvline(TRUE, color="black", linestyle=":", label="true")
    axes.legend()
    axes.figure.savefig(folder / "10_fit_to_data.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
