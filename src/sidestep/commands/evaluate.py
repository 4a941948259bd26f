"""`sidestep evaluate`: ours and other navigators in the same seeded worlds, and whether predicted risks come true."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

FULL, QUICK = 200, 20
CALIBRATION_FULL, CALIBRATION_QUICK = 3400, 60  # of 15 steps each: more than 50,000
TRIPS_FULL, TRIPS_QUICK = 40, 4
MOMENTS_FULL, MOMENTS_QUICK = 600, 30


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
    import json as text

    from sidestep.commands.console import emit_json, plain, table
    from sidestep.io.files import ready_folder, ready_for, written
    from sidestep.studies.engines import processes

    of_people: dict[str, object] = {
        "--studies": studies, "--without": without, "--vehicle": vehicle, "--model": model, "--trips": trips,
        "--crowd": crowd, "--moments": moments, "--ablations": ablations,
    }  # fmt: skip
    of_worlds: dict[str, object] = {"--conditions": conditions, "--fewer": fewer}
    if not people:
        _none_of(of_people, "only together with --people TRACKS")
    if people:
        _none_of(of_worlds | {"--episodes": episodes, "--calibration": calibration}, "only without --people")
    elif calibration:
        _none_of(of_worlds | {"--navigators": navigators}, "only without --calibration")
    ready_for(page)
    folder, jobs = ready_folder(out), processes(workers)
    if people:
        from sidestep.commands.evaluate_people import DRIVERS, STUDIES, PeopleRequest, evaluate_people, name_of
        from sidestep.commands.evaluate_people_report import report

        studies = studies or ",".join(STUDIES)
        trips = _count(trips, quick, TRIPS_FULL, TRIPS_QUICK)
        moments = _count(moments, quick, MOMENTS_FULL, MOMENTS_QUICK)
        request = PeopleRequest(
            files=people,
            studies=tuple(studies.split(",")),
            without=tuple(filter(None, without.split(","))),
            model=model,
            vehicles=tuple(vehicle.split(",")) if vehicle else (),
            navigators=tuple((navigators or DRIVERS).split(",")),
            trips=trips,
            crowd=crowd,
            moments=moments,
            ablations=ablations,
            seed=seed,
            workers=jobs,
            engine=engine,
            address=address,
            folder=folder,
        )
        command = "sidestep evaluate " + " ".join(f"--people {name_of(file)}" for file in people)
        command += f" --studies {studies} --moments {moments} --trips {trips}"
        command += "".join(
            f" --{k} {v}" for k, v in (("crowd", crowd), ("vehicle", vehicle), ("without", without)) if v
        )
        command += " --ablations" * ablations + f" --navigators {navigators}" * bool(navigators)
        report(evaluate_people(request), folder, page, command, json=json)
        return
    if calibration:
        from sidestep.commands.calibration import calibrated

        count = _count(episodes, quick, CALIBRATION_FULL, CALIBRATION_QUICK)
        found = calibrated(count, seed, jobs, engine, address, folder, page)
        result: dict[str, Any] = {"calibration": found}
        rows = [[k, f"{v['ece']:.4f}", f"{v['brier']:.4f}", str(v["n"]), str(v["steps"])] for k, v in found.items()]
        header: tuple[str, ...] = ("people", "expected calibration error", "Brier", "pairs", "steps")
    else:
        result = _compared(quick, conditions, navigators, episodes, _counts(fewer), seed, jobs, engine, address, folder)
        rows = [_line(row) for row in result["conditions"]]
        header = ("condition", "navigator", "n", "moving contacts", "99 % bound", "standing", "success", "time s")
        if page is not None:
            from sidestep.commands.evaluate_report import write_peers_page

            asked = {"conditions": conditions, "navigators": navigators, "episodes": episodes, "fewer": fewer}
            command = " ".join(["sidestep evaluate", *(f"--{k} {v}" for k, v in asked.items() if v)])
            write_peers_page(result, page, command)
    with written(folder / ("calibration.json" if calibration else "results.json")) as file:
        file.write(text.dumps(plain(result), indent=1).encode())
    if json:
        emit_json(result)
        return
    table(rows, header=header)
    for name, why in result.get("skipped", []):
        print(f"left out: {name} ({why})")


def _none_of(options: Mapping[str, object], when: str) -> None:
    """Refuse options that would be of no effect, so that nobody takes them to have had one."""
    from sidestep.errors import InvalidInput

    for name, value in options.items():
        if value is not None and value is not False and value != "":
            raise InvalidInput(name, value if isinstance(value, int) else str(value), when)


def _count(asked: int | None, quick: bool, full: int, few: int) -> int:
    return (few if quick else full) if asked is None else asked


def _compared(
    quick: bool,
    conditions: str | None,
    navigators: str | None,
    episodes: int | None,
    fewer: dict[str, int],
    seed: int,
    jobs: int,
    engine: str,
    address: str | None,
    folder: Path,
) -> dict[str, Any]:
    from importlib.util import find_spec

    from sidestep.commands.bars import progress_bar
    from sidestep.io.checkpoints import Checkpoints
    from sidestep.studies.conditions import conditions as every_condition
    from sidestep.studies.evaluate import evaluate as run
    from sidestep.studies.evaluate_table import aims, condition_rows, pooled, price_of_unconcern
    from sidestep.studies.opponents import contestants

    peers = all(find_spec(name) is not None for name in ("pyrvo", "navground", "casadi"))
    worlds, everybody = every_condition(), contestants()
    skipped = [] if peers else [(n, "needs the extra [peers]") for n, c in everybody.items() if c.needs_peers]
    chosen = (
        conditions.split(",")
        if conditions
        else [n for n, c in worlds.items() if (peers or not c.needs_peers) and (c.quick or not quick)]
    )
    drivers = (
        navigators.split(",")
        if navigators
        else [n for n, c in everybody.items() if (peers or not c.needs_peers) and (c.quick or not quick)]
    )
    with progress_bar("episodes") as tell:
        found = run(
            chosen,
            drivers,
            episodes=_count(episodes, quick, FULL, QUICK),
            fewer=fewer,
            seed=seed,
            workers=jobs,
            engine=engine,
            address=address,
            store=Checkpoints(folder / "pieces"),
            progress=tell,
        )
    rows = condition_rows(found)
    return {
        "conditions": rows,
        "aims": aims(rows),
        "pooled": pooled(found),
        "price_of_unconcern": price_of_unconcern(found),
        "skipped": [list(s) for s in skipped],
    }


def _counts(text: str) -> dict[str, int]:
    """Return name → count of "NAME=COUNT,…"."""
    from sidestep.errors import InvalidInput

    counts: dict[str, int] = {}
    for part in filter(None, text.split(",")):
        name, _, count = part.partition("=")
        if not count.isdecimal():
            raise InvalidInput("fewer", part, "NAME=COUNT, COUNT an integer ≥ 1")
        counts[name] = int(count)
    return counts


def _line(row: dict[str, Any]) -> list[str]:
    time = row["time_to_goal"]
    return [
        row["name"],
        row["navigator"],
        str(row["episodes"]),
        f"{row['collision_moving']:.3f}",
        f"{row['collision_moving_upper99']:.3f}",
        f"{row['collision_standing']:.3f}",
        f"{row['success']:.3f}",
        "–" if time is None else f"{time:.2f}",
    ]
