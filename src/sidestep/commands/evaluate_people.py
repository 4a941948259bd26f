"""What `sidestep evaluate --people` does: predictions, beliefs and trips on recorded people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sidestep.checks import counted, one_of, seeded
from sidestep.commands.evaluate_run import Run, words
from sidestep.errors import InvalidInput

if TYPE_CHECKING:
    from sidestep.human.model import HumanModel
    from sidestep.simulation.recordings import Recording
    from sidestep.studies.people_awareness import Vehicle

TRIPS_FULL, TRIPS_QUICK = 40, 4
MOMENTS_FULL, MOMENTS_QUICK = 600, 30
STUDIES = ("prediction", "awareness", "replay")
DRIVERS = "sidestep,orca,mpc,chance,stop-and-go"


@dataclass(frozen=True, slots=True, kw_only=True)
class PeopleRequest:
    """What was asked for, as on the command line (see `sidestep evaluate --help`), and what follows from it."""

    run: Run
    people: tuple[Path, ...]
    studies: str | None
    without: str
    vehicle: str | None
    model: Path | None
    navigators: str | None
    trips: int | None
    crowd: int | None
    moments: int | None
    ablations: bool

    @property
    def chosen(self) -> tuple[str, ...]:
        """Names of the studies."""
        return chosen_studies(self.studies)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of scenes."""
        return tuple(filter(None, self.without.split(",")))

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Words for what drives around, one per file; () for its kind."""
        return tuple(self.vehicle.split(",")) if self.vehicle else ()

    @property
    def drivers(self) -> tuple[str, ...]:
        """Names of the navigators."""
        return tuple((self.navigators or DRIVERS).split(","))

    @property
    def trip_count(self) -> int:
        """Trips of each navigator through each file."""
        return self.run.count(self.trips, TRIPS_FULL, TRIPS_QUICK)

    @property
    def moment_count(self) -> int:
        """Moments that are predicted per file, about."""
        return self.run.count(self.moments, MOMENTS_FULL, MOMENTS_QUICK)

    @property
    def command(self) -> str:
        """The command that asks for the same."""
        chosen = self.chosen
        return " ".join(
            [
                "sidestep evaluate",
                *(f"--people {name_of(file)}" for file in self.people),
                f"--studies {','.join(chosen)}",
                *words(
                    moments="prediction" in chosen and self.moment_count, trips="replay" in chosen and self.trip_count
                ),
                *words(crowd=self.crowd, vehicle=self.vehicle, without=self.without),
                *["--ablations"] * self.ablations,
                *words(navigators=self.navigators),
            ]
        )


def chosen_studies(asked: str | None) -> tuple[str, ...]:
    """Return the studies of recorded people: those asked for by their names, or all."""
    names = tuple(asked.split(",")) if asked else STUDIES
    one_of("--studies", names, STUDIES)
    return names


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
    recorded = [read_recordings(file) for file in request.people]
    one_of("--without", request.left_out, {name for recordings in recorded for name in recordings})
    kept = [{k: r for k, r in every.items() if k not in request.left_out} for every in recorded]
    for file, recordings in zip(request.people, kept, strict=True):
        check_people(recordings.values(), ("ped",), str(file))
    for n, (file, recordings) in enumerate(zip(request.people, kept, strict=True)):
        label = {"file": name_of(file)}
        if "prediction" in request.chosen:
            rows = _predictions(recordings, model, request)
            if not rows:
                say(f"{file}: no predictions scored: fewer than two people seen for 7.6 s, every 0.85 s at least")
            found["prediction"] += [label | row for row in rows]
        vehicle = vehicle_of(recordings, request.vehicles[n] if request.vehicles else None)
        if "awareness" in request.chosen and vehicle is not None:
            found["awareness"] += [label | row for row in _beliefs(recordings, model, vehicle, request)]
        if "replay" in request.chosen:
            rows = _trips(file, model, request)
            if not rows:
                say(f"{file}: no trips: no scene of over 10 s in which a robot meets somebody on a way of 7 to 10 m")
            found["replay"] += [label | row for row in rows]
    return {"people": found, "seed": request.run.seed}


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
    if "replay" in request.chosen:
        from sidestep.studies.opponents import contestants

        one_of("--navigators", request.drivers, contestants())
    if request.vehicles and len(request.vehicles) != len(request.people):
        raise InvalidInput("--vehicle", ",".join(request.vehicles), f"{len(request.people)} names, one per --people")
    for name, value in (
        ("--trips", request.trip_count),
        ("--moments", request.moment_count),
        ("--crowd", 1 if request.crowd is None else request.crowd),
    ):
        counted(name, value)
    seeded("--seed", request.run.seed)


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
            most=request.moment_count,
            seed=request.run.seed,
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
            rows = awareness_study(recordings, chosen, vehicle, seed=request.run.seed, progress=tell)
        found += [{"evidence": evidence} | row for row in rows]
    return found


def _trips(file: Path, model: HumanModel, request: PeopleRequest) -> Sequence[dict[str, Any]]:
    from sidestep.commands.bars import progress_bar
    from sidestep.studies.people_replay import replay_study

    with progress_bar("trips") as tell:
        return replay_study(
            file,
            request.drivers,
            trips=request.trip_count,
            without=request.left_out,
            crowd=request.crowd,
            human=model,
            **request.run.work(tell),
        )
