"""Only the prediction, inside somebody else's planner.

You have a planner and want to know what a candidate motion risks. `predict` gives the person's
occupancy under that very motion, once as a concerned and once as an unconcerned person; `RiskField`
turns it into the probability of being too near.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import sidestep
from sidestep.human.goals import PointGoal
from sidestep.prediction.collision import PersonMass, RiskField
from sidestep.prediction.occupancy import frame_of, predict

HORIZON, STEP, CLEARANCE = 8, 0.5, 0.7  # steps, s, m


def risk(path: np.ndarray, concerned: float) -> float:
    """P(nearer than the clearance) at the worst instant along `path` ((2N+2, 2) m, further than the horizon)."""
    model = sidestep.HumanModel(randomness=0.1)
    position, velocity = (-3.0, 0.0), (1.0, 0.0)
    prediction = predict(
        model=model,
        lattice=frame_of(model, position, velocity, STEP),
        goals=[PointGoal((5.0, 0.0))],
        weights=[[1 - concerned, concerned]],
        robot_path=path,
        horizon=HORIZON,
        time_step=STEP,
    )
    field = RiskField(people=[PersonMass.of_prediction(prediction)], distances=np.array([CLEARANCE]))
    return float(field.along(path[: HORIZON + 1]).max())


def main(folder: Path) -> None:
    angles = np.linspace(-70, 70, 29)  # degrees away from straight up
    k = np.arange(2 * HORIZON + 2)[:, None]
    axes = Figure(figsize=(6, 4), layout="constrained").add_subplot(
        xlabel="direction of the candidate motion (degrees)", ylabel="risk", yscale="log", ylim=(1e-4, 1)
    )
    beliefs = {"unconcerned": (0.0, "#D55E00"), "unknown": (0.5, "#CC79A7"), "concerned": (1.0, "#009E73")}
    for name, (concerned, colour) in beliefs.items():
        risks = []
        for angle in np.radians(angles):
            path = np.array([0.0, -3.0]) + STEP * k * np.array([np.sin(angle), np.cos(angle)])  # 1 m/s
            risks.append(risk(path, concerned))
        best = np.argmin(risks)
        print(f"{name}: straight on {risks[len(angles) // 2]:.3f}, best {risks[best]:.4f} at {angles[best]:.0f}°")
        axes.plot(angles, np.maximum(risks, 1e-4), color=colour, label=name)
    axes.legend(title="the person is")
    axes.figure.savefig(folder / "08_predictor_only.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
