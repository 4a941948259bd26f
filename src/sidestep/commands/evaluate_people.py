"""What `sidestep evaluate --people` does: predictions, beliefs and trips on recorded people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.checks import counted, one_of, seeded
from sidestep.errors import InvalidInput

if TYPE_CHECKING:
    from sidestep.human.model import HumanModel
    from sidestep.simulation.recordings import Recording
    from sidestep.studies.people_awareness import Vehicle

STUDIES = ("prediction", "awareness", "replay")
DRIVERS = "sidestep,orca,mpc,chance,stop-and-go"


@dataclass(frozen=True, slots=True, kw_only=True)
class PeopleRequest:
    """What was asked for; see `sidestep evaluate --help`."""

    files: tuple[Path, ...]
    studies: tuple[str, ...]
    without: tuple[str, ...]
    model: Path | None
    vehicles: tuple[str, ...]
    navigators: tuple[str, ...]
    trips: int
    crowd: int | None
    moments: int
    ablations: bool
    seed: int
    workers: int
    engine: str
    address: str | None
    folder: Path


def evaluate_people(request: PeopleRequest) -> dict[str, Any]:
    """Run the studies on every file; the object that --json prints."""
    from sidestep.commands.console import say
    from sidestep.human.model import HumanModel
    from sidestep.io.human_models import read_human_model
    from sidestep.io.tracks import read_recordings
    from sidestep.simulation.recordings import check_people

    _check(request)
    model = HumanModel() if request.model is None else read_human_model(request.model)
    found: dict[str, list[dict[str, Any]]] = {study: [] for study in STUDIES}
    recorded = [read_recordings(file) for file in request.files]
    one_of("--without", request.without, {name for recordings in recorded for name in recordings})
    kept = [{k: r for k, r in every.items() if k not in request.without} for every in recorded]
    for file, recordings in zip(request.files, kept, strict=True):
        check_people(recordings.values(), ("ped",), str(file))
    for n, (file, recordings) in enumerate(zip(request.files, kept, strict=True)):
        label = {"file": name_of(file)}
        if "prediction" in request.studies:
            rows = _predictions(recordings, model, request)
            if not rows:
                say(f"{file}: no predictions scored: fewer than two people seen for 7.6 s, every 0.85 s at least")
            found["prediction"] += [label | row for row in rows]
        vehicle = vehicle_of(recordings, request.vehicles[n] if request.vehicles else None)
        if "awareness" in request.studies and vehicle is not None:
            found["awareness"] += [label | row for row in _beliefs(recordings, model, vehicle, request)]
        if "replay" in request.studies:
            rows = _trips(file, model, request)
            if not rows:
                say(f"{file}: no trips: no scene of over 10 s in which a robot meets somebody on a way of 7 to 10 m")
            found["replay"] += [label | row for row in rows]
    return {"people": found, "seed": request.seed}


def name_of(file: Path) -> str:
    """Return what a file of tracks is called in tables: its folder where it is called tracks itself."""
    name = file.name.removesuffix(".gz").removesuffix(".csv")
    return file.resolve().parent.name if name == "tracks" else name


def vehicle_of(recordings: Mapping[str, Recording], name: str | None) -> Vehicle | None:
    """Return the size of what drives around: as named, or by its kind; None where nothing does."""
    from sidestep.studies.people_awareness import CAR, CART, ROBOT

    known = {"car": CAR, "cart": CART, "robot": ROBOT}
    kinds = {track.kind for recording in recordings.values() for track in recording.tracks}
    if name is not None:
        return known[name] if kinds - {"ped"} else None
    return ROBOT if "robot" in kinds else CAR if kinds - {"ped"} else None


def _check(request: PeopleRequest) -> None:
    one_of("--vehicle", request.vehicles, ("car", "cart", "robot"))
    if "replay" in request.studies:
        from sidestep.studies.opponents import contestants

        one_of("--navigators", request.navigators, contestants())
    if request.vehicles and len(request.vehicles) != len(request.files):
        raise InvalidInput("--vehicle", ",".join(request.vehicles), f"{len(request.files)} names, one per --people")
    for name, value in (
        ("--trips", request.trips),
        ("--moments", request.moments),
        ("--crowd", 1 if request.crowd is None else request.crowd),
    ):
        counted(name, value)
    seeded("--seed", request.seed)


def _predictions(
    recordings: Mapping[str, Recording], model: HumanModel, request: PeopleRequest
) -> Sequence[dict[str, Any]]:
    from sidestep.commands.bars import progress_bar
    from sidestep.studies.people_prediction import prediction_study

    with progress_bar("predictions") as tell:
        return prediction_study(
            recordings,
            model,
            fitted=True,
            ablations=request.ablations,
            most=request.moments,
            seed=request.seed,
            progress=tell,
        )


def _beliefs(
    recordings: Mapping[str, Recording], model: HumanModel, vehicle: Vehicle, request: PeopleRequest
) -> Sequence[dict[str, Any]]:
    from sidestep.commands.bars import progress_bar
    from sidestep.studies.people_awareness import awareness_study

    models = {"clearance": model}
    if request.ablations:
        models["action"] = replace(model, evidence="action")
    found: list[dict[str, Any]] = []
    for evidence, chosen in models.items():
        with progress_bar(f"beliefs by {evidence}") as tell:
            rows = awareness_study(recordings, chosen, vehicle, seed=request.seed, progress=tell)
        found += [{"evidence": evidence} | row for row in rows]
    return found


def _trips(file: Path, model: HumanModel, request: PeopleRequest) -> Sequence[dict[str, Any]]:
    from sidestep.commands.bars import progress_bar
    from sidestep.io.checkpoints import Checkpoints
    from sidestep.studies.people_replay import replay_study

    with progress_bar("trips") as tell:
        return replay_study(
            file,
            request.navigators,
            trips=request.trips,
            without=request.without,
            crowd=request.crowd,
            human=model,
            seed=request.seed,
            workers=request.workers,
            engine=request.engine,
            address=request.address,
            store=Checkpoints(request.folder / "pieces"),
            progress=tell,
        )
