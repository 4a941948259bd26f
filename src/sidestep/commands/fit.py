"""`sidestep fit`: a human model from tracks, and what it is worth on scenes that it was not fitted to."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def fit(
    tracks: Path,
    *,
    out: Path = Path("human.toml"),
    start: Path | None = None,
    kinds: str = "ped",
    without: str = "",
    every: float = 0.8,
    most: int = 600,
    seed: int = 0,
    json: bool = False,
) -> None:
    """Fit how steadily, how randomly and from where to where people go, by maximum likelihood; write a model file.

    The file can stand in a scenario (human = "FILE"), in `sidestep run --set human=FILE` and in `sidestep evaluate
    --model FILE`. Weight and rate of the danger and the rationality show only where somebody stands in the way: they
    are kept.

    Args:
        tracks: CSV of recorded people, scene,t,agent,kind,x,y, plain or .gz.
        out: file to write.
        start: human model to start from; the defaults unless given.
        kinds: comma-separated kinds of agents that are people.
        without: comma-separated scenes that are left out.
        every: s between the moments of a track.
        most: about so many moments are scored with one scene left out at a time, or a quarter of the people of a
            single one; 0: no such score.
        seed: of the choice of moments.
        json: print one JSON object and nothing else.
    """
    from sidestep.commands.console import emit_json, show

    result = make(
        tracks,
        out=out,
        start=start,
        kinds=tuple(kinds.split(",")),
        without=tuple(filter(None, without.split(","))),
        every=every,
        most=most,
        seed=seed,
    )
    if json:
        emit_json(result)
        return
    speeds, model = result["walking_speeds"], result["model"]
    if speeds["q50"] is not None:
        show(f"walking speed {speeds['q50']:.2f} m/s (5 to 95 %: {speeds['q05']:.2f} to {speeds['q95']:.2f})")
    show(f"people stand in {100 * (speeds['standing'] or 0.0):.0f} % of their steps")
    show(f"measurement noise {model['measurement_noise']:g} m, randomness {result['randomness']:.4f}")
    show(f"fitted to {result['moments']} moments: {result['nll']:.3f} nat ({result['nll_before']:.3f} before)")
    if most > 0 and not result["left_out"]:
        show("not scored: nobody can be left out where only one person was seen for long enough")
    _show_scores(result["left_out"])
    show(f"wrote {result['file']}")


def make(
    tracks: Path,
    *,
    out: Path,
    start: Path | None,
    kinds: tuple[str, ...],
    without: tuple[str, ...],
    every: float,
    most: int,
    seed: int,
) -> dict[str, Any]:
    """Fit, score, write; the object that --json prints."""
    from dataclasses import asdict

    from sidestep.checks import one_of, seeded
    from sidestep.commands.bars import progress_bar
    from sidestep.errors import InvalidInput
    from sidestep.human.model import HumanModel
    from sidestep.io.files import ready_for
    from sidestep.io.human_models import read_human_model, write_human_model
    from sidestep.io.tracks import read_recordings
    from sidestep.simulation.recordings import check_people
    from sidestep.studies.people_fit import fit_model, walking_speeds
    from sidestep.studies.people_prediction import prediction_study
    from sidestep.types import LARGEST

    seeded("--seed", seed)
    ready_for(out)
    if not 0.0 < every <= LARGEST:
        raise InvalidInput("--every", every, "a finite number > 0 (s)")
    if most < 0:
        raise InvalidInput("--most", most, "an integer ≥ 0")
    every_scene = read_recordings(tracks)
    one_of("--without", without, every_scene)
    recordings = {k: r for k, r in every_scene.items() if k not in without}
    check_people(recordings.values(), kinds, str(tracks))
    model = HumanModel() if start is None else read_human_model(start)
    with progress_bar("fit") as tell:
        found = fit_model(recordings, model, kinds=kinds, every=every, seed=seed, progress=tell)
    left_out: list[dict[str, Any]] = []
    if most > 0:
        with progress_bar("what is left out at a time") as tell:
            left_out = prediction_study(
                recordings, model, kinds=kinds, fitted=True, every=every, most=most, seed=seed, progress=tell
            )
    habits = found.model.habits
    random = habits.changed_before / habits.counts_before if model.online_randomness else found.model.randomness
    notes = {"fitted to": tracks.name, "moments": found.moments, "nll": f"{found.nll:.4f} nat"}
    return {
        "file": str(write_human_model(found.model, out, notes)),
        "model": asdict(found.model),
        "moments": found.moments,
        "nll": found.nll,
        "nll_before": found.before,
        "nll_by_noise": {f"{noise:g}": value for noise, value in found.noises.items()},
        "randomness": random,
        "walking_speeds": walking_speeds(recordings, kinds),
        "left_out": left_out,
    }


def _show_scores(rows: list[dict[str, Any]]) -> None:
    from sidestep.commands.console import table

    whole = [r for r in rows if r["scene"] == "all"]
    if not whole:
        return
    lines = [
        [r["predictor"], f"{r['horizon']:g}", str(r["moments"]), f"{r['nll']:.3f}", f"{r['coverage_95']:.3f}"]
        for r in whole
    ]
    header = ("predictor", "s ahead", "moments", "log loss, nat", "95 % region covers")
    table(lines, title="left out, a scene at a time or a quarter of the people of a single one", header=header)
