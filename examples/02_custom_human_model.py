"""What is assumed of a person changes the way.

The same head-on encounter, planned with three models: the default; one that is sure that people watch; one
that is sure that they do not. The person who comes does watch, and gives way: who trusts them goes straight on,
who does not makes room for both. (Where the person does not watch, all three make room: where somebody walks is
learned, too.)
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import sidestep
from sidestep.io.scenarios import load_scenario
from sidestep.simulation.metrics import measure

MODELS = {
    "learns who watches": sidestep.HumanModel(),
    "trusts everybody": sidestep.HumanModel(prior_concerned=0.999, switch_rate=0.0),
    "trusts nobody": sidestep.HumanModel(prior_concerned=0.001, switch_rate=0.0),
}


def main(folder: Path) -> None:
    axes = Figure(figsize=(5.5, 5), layout="constrained").add_subplot(xlabel="x (m)", ylabel="y (m)", xlim=(-2.2, 2.2))
    for (name, model), colour in zip(MODELS.items(), ("#0072B2", "#009E73", "#CC79A7"), strict=True):
        scenario = load_scenario("head-on", ["people.0.kind=concerned"]).changed(human=model)
        record = sidestep.simulate(scenario, seed=0)
        aside = abs(record.robot_positions[:, 0]).max()
        label = f"{name}: {aside:.2f} m aside, nearest {measure(record).min_distance:.2f} m"
        print(label)
        axes.plot(*record.robot_positions.T, color=colour, marker="o", markersize=3, label=label)
        axes.plot(*record.people_positions[:, 0].T, color="#D55E00", linewidth=1)
    axes.plot([], [], color="#D55E00", linewidth=1, label="the person, three times")
    axes.figure.legend(fontsize="small", loc="outside lower center")
    axes.figure.savefig(folder / "02_custom_human_model.png", dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
