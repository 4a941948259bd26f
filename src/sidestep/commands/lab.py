"""`sidestep lab`: scanner, tracker, planner and base in one loop; the tracker's score on recordings; its training."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter


def lab(
    *,
    human: Literal["concerned", "unconcerned"] | None = None,
    planner_rate: float = 2.0,
    latency: float = 0.0,
    dropout: float = 0.0,
    goals: Literal["known", "candidates", "unknown"] = "known",
    seeds: int = 1,
    seed: int = 0,
    kinematic: Annotated[bool, Parameter(negative="")] = False,
    workers: int = 1,
    out: Path = Path("runs/lab"),
    score: Path | None = None,
    train: Path | None = None,
    labelled: Annotated[tuple[Path, ...], Parameter(negative="", consume_multiple=True)] = (),
    classifier: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Drive a LoCoBot-sized base past people whom it knows from a leg tracker alone; or score or train that tracker.

    Args:
        human: the kind that the numbers are about; both unless given. Both walk through the same rooms in any case:
            the figure and the ratio of PI_R need them.
        planner_rate: Hz.
        latency: ms, from the end of a scan until the planner has it.
        dropout: share of the scans that never arrive.
        goals: what the planner knows of where someone who walks is going: the place, as in the paper, four places
            of which one is right, or nothing.
        seeds: rooms, each with another crossing.
        seed: of the first room.
        kinematic: without MuJoCo: the base follows its commands exactly.
        workers: processes.
        out: folder for results.json, the figure and the records of the first room.
        score: a recording of a scanner (.npz) instead: how well the tracker does on it.
        train: file (.npz) for a leg classifier, trained anew on simulated scans.
        labelled: with --train: also learn from these recordings with labelled legs, or with nobody in them.
        classifier: trained with --train, instead of the one that comes with the package.
        json: print exactly one JSON object on stdout.
    """
    from sidestep.commands.options import refuse
    from sidestep.errors import InvalidInput

    if labelled and train is None:
        raise InvalidInput("--labelled", [str(path) for path in labelled], "only together with --train FILE.npz")
    if train is not None and score is not None:
        raise InvalidInput("--score", str(score), "only without --train", "train first, then score with --classifier")
    if train is not None or score is not None:
        refuse(
            lab, "only without --score and --train", human=human, planner_rate=planner_rate, latency=latency,
            dropout=dropout, goals=goals, seeds=seeds, kinematic=kinematic, workers=workers, out=out,
        )  # fmt: skip
        if train is not None:
            refuse(lab, "only without --train", classifier=classifier)
        else:
            refuse(lab, "only without --score", seed=seed)
        from sidestep.commands import lab_tracker

        if train is not None:
            lab_tracker.train(train, labelled, seed=seed, json=json)
        elif score is not None:
            lab_tracker.score(score, classifier, json=json)
        return
    from sidestep.commands import lab_runs
    from sidestep.simulation.lab_room import LabSettings

    settings = LabSettings(
        planner_rate=planner_rate,
        latency=latency / 1e3,
        dropout=dropout,
        goals=goals,
        physics="kinematic" if kinematic else "mujoco",
        seed=seed,
    )
    lab_runs.drive(settings, human=human, seeds=seeds, workers=workers, classifier=classifier, out=out, json=json)
