"""`sidestep evaluate`: ours and other navigators in the same seeded worlds, and whether predicted risks come true."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from sidestep.commands.evaluate_run import Run

CALIBRATION_FULL, CALIBRATION_QUICK = 3400, 60  # of 15 steps each: more than 50,000


def evaluate(
    *,
    quick: bool = False,
    conditions: str | None = None,
    navigators: str | None = None,
    episodes: int | None = None,
    fewer: str = "",
    calibration: bool = False,
    people: tuple[Path, ...] = (),
    studies: str | None = None,
    without: str = "",
    vehicle: str | None = None,
    model: Path | None = None,
    trips: int | None = None,
    crowd: int | None = None,
    moments: int | None = None,
    ablations: bool = False,
    seed: int = 0,
    workers: int | None = None,
    engine: str = "joblib",
    address: str | None = None,
    out: Path = Path("results/evaluation"),
    page: Path | None = None,
    json: bool = False,
) -> None:
    """Run many episodes and print rates with exact intervals; finished pieces are kept and not run again.

    Args:
        quick: few episodes of few conditions and navigators, few trips and moments of recorded people.
        conditions: comma-separated names; all by default.
        navigators: comma-separated names; all that are installed by default.
        episodes: per condition and navigator (or per kind of people, for the calibration).
        fewer: comma-separated NAME=COUNT: conditions or navigators that get at most so many episodes; condition:NAME or
            navigator:NAME where both have the name.
        calibration: compare predicted collision probabilities with realised frequencies instead.
        people: recorded people instead (CSV of tracks, may be given several times): predictions against a fitted
            constant-velocity model, beliefs against who reacted, trips through people who do not react.
        studies: which of prediction, awareness, replay; with --people; all unless given.
        without: comma-separated scenes that are left out; with --people.
        vehicle: car, cart or robot, comma-separated, one for each --people; by its kind unless given.
        model: human model that `sidestep fit` wrote; with --people; the defaults unless given.
        trips: of each navigator through each file of recorded people; 40 unless given, 4 if quick.
        crowd: most people at once on such a trip; any number by default.
        moments: about so many are predicted per file of recorded people; 600 unless given, 30 if quick.
        ablations: also predict recorded people with parts of the model taken away.
        seed: base of all seeds.
        workers: processes; all cores by default.
        engine: joblib (this machine) or ray (a cluster).
        address: of the Ray cluster; one is started here unless given.
        out: folder for results.json and finished pieces.
        page: JSON file to write for the pages of evidence, with the figures in ../../figures.
        json: print one JSON object and nothing else.
    """
    from sidestep.commands.evaluate_people import PeopleRequest, chosen_studies, evaluate_people
    from sidestep.commands.evaluate_people_report import report
    from sidestep.commands.options import refuse
    from sidestep.io.files import ready_folder, ready_for
    from sidestep.studies.engines import processes

    of_study: dict[str, dict[str, Any]] = {
        "prediction": {"moments": moments},
        "awareness": {"vehicle": vehicle},
        "replay": {"trips": trips, "crowd": crowd},
    }
    of_people: dict[str, Any] = {"studies": studies, "without": without, "model": model, "ablations": ablations}
    for own in of_study.values():
        of_people |= own
    of_worlds: dict[str, object] = {"conditions": conditions, "fewer": fewer}
    if not people:
        refuse(evaluate, "only together with --people TRACKS", **of_people)
    if people:
        refuse(evaluate, "only without --people", **of_worlds, episodes=episodes, calibration=calibration)
        of_study["replay"] |= {"navigators": navigators, "workers": workers, "engine": engine, "address": address}
        _refuse_without(chosen_studies(studies), of_study, ablations)
    elif calibration:
        refuse(evaluate, "only without --calibration", **of_worlds, navigators=navigators)
    ready_for(page)
    run = Run(
        quick=quick,
        seed=seed,
        folder=ready_folder(out),
        workers=processes(workers),
        engine=engine,
        address=address,
        page=page,
        json=json,
    )
    if people:
        request = PeopleRequest(run=run, people=people, navigators=navigators, **of_people)
        report(evaluate_people(request), run.folder, run.page, request.command, json=json)
    elif calibration:
        _calibrated(run, episodes)
    else:
        from sidestep.commands.evaluate_worlds import evaluate_worlds

        evaluate_worlds(run, conditions, navigators, episodes, fewer)


def _calibrated(run: Run, episodes: int | None) -> None:
    """Predicted collision probabilities against what came true."""
    from sidestep.commands.calibration import calibrated

    count = run.count(episodes, CALIBRATION_FULL, CALIBRATION_QUICK)
    found = calibrated(run, count)
    rows = [[k, f"{v['ece']:.4f}", f"{v['brier']:.4f}", str(v["n"]), str(v["steps"])] for k, v in found.items()]
    header = ("people", "expected calibration error", "Brier", "pairs", "steps")
    run.told({"calibration": found}, "calibration.json", header, rows)


def _refuse_without(studies: Collection[str], options: Mapping[str, Mapping[str, object]], ablations: bool) -> None:
    """Check that only options (study → name → value) of the chosen studies of recorded people are given."""
    from sidestep.commands.options import refuse

    for study, own in options.items():
        if study not in studies:
            refuse(evaluate, f"only with {study} among --studies", **own)
    if not {"prediction", "awareness"} & set(studies):
        refuse(evaluate, "only with prediction or awareness among --studies", ablations=ablations)
