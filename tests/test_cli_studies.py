"""The commands of the studies: one JSON object, figures that exist, one line per mistake."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NoReturn

import pytest

from sidestep.cli import BAD_INPUT, FAILURE, execute
from sidestep.commands.evaluate_report import page_title
from sidestep.studies.conditions import conditions
from sidestep.studies.engines import WorkersLost


@pytest.mark.parametrize("command", [["bench", "--quick"], ["study", "robots"], ["evaluate"], ["reproduce", "--quick"]])
def test_a_page_that_cannot_be_written_is_refused_before_time_is_spent(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("no folder")
    page, out = tmp_path / "file" / "page.json", tmp_path / "out"
    assert execute([*command, "--out", str(out), "--page", str(page)]) != 0
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert "file: cannot be written" in told.err
    assert not list(out.rglob("*"))


def test_a_model_that_cannot_be_written_is_refused_before_it_is_fitted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fitted(*args: object, **kwargs: object) -> None:
        pytest.fail("time was spent")

    monkeypatch.setattr("sidestep.studies.people_fit.fit_model", fitted)
    (tmp_path / "file").write_text("no folder")
    tracks = tmp_path / "tracks.csv"
    tracks.write_text("scene,t,agent,kind,x,y\ns,0,a,ped,0,0\n")
    assert execute(["fit", str(tracks), "--out", str(tmp_path / "file" / "model.toml")]) == BAD_INPUT
    assert "file: cannot be written" in capsys.readouterr().err


def test_recorded_runs_that_are_not_there_are_named_before_time_is_spent(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*args: object, **kwargs: object) -> None:
        pytest.fail("time was spent")

    monkeypatch.setattr("sidestep.studies.paper.run_points", run)
    out = tmp_path / "out"
    for held in ((), ("tracks.csv.gz",)):
        for name in held:
            (tmp_path / name).touch()
        assert execute(["reproduce", "--quick", "--data", str(tmp_path), "--out", str(out)]) == BAD_INPUT
        assert "--data" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.slow
def test_evaluate_compares_navigators(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--conditions", "straight", "--navigators", "sidestep,stop-and-go", "--episodes", "2", "--workers", "1"]
    page = tmp_path / "made" / "with it" / "page.json"
    fewer = ["--fewer", "stop-and-go=1"]
    assert execute(["evaluate", *options, *fewer, "--out", str(tmp_path), "--page", str(page), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [r["navigator"] for r in result["conditions"]] == ["sidestep", "stop-and-go"]
    for row in result["conditions"]:
        assert 0 <= row["collision_moving"] <= row["collision_moving_upper99"] <= 1
    assert (tmp_path / "results.json").is_file()
    assert [r["episodes"] for r in result["pooled"]] == [2, 1]
    written = json.loads(page.read_text())
    assert written["command"] == " ".join(["sidestep", "evaluate", *options[:6], *fewer])
    assert all(len(row) == len(t["header"]) for t in written["tables"] for row in t["rows"])
    assert written["title"] == "Against other planners: keeps walking"
    for figure in written["figures"]:
        assert (page.parent / figure["file"]).stat().st_size > 10_000


def test_a_page_about_some_conditions_says_which() -> None:
    told = {
        ("crowd-5-all-unconcerned",): ": 5 people, all unconcerned",
        (
            "corridor",
            "half-random",
            "crowd-5-half-unconcerned",
            "crowd-12-all-unconcerned",
        ): ": corridor, half-random, crowd",
        tuple(conditions()): "",
    }
    for names, words in told.items():
        assert page_title(names, among_peers=True) == "Against other planners" + words


@pytest.mark.slow
def test_ablations_are_told_apart_from_opponents(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drivers = ["sidestep-cells", "sidestep-no-directions", "stop-and-go"]
    options = ["--conditions", "straight-2hz", "--navigators", ",".join(drivers), "--episodes", "1", "--workers", "1"]
    assert execute(["evaluate", *options, "--out", str(tmp_path), "--page", str(tmp_path / "page.json")]) == 0
    printed = capsys.readouterr().out
    assert all(f" {name} " in printed for name in drivers)
    tables = {t["title"]: t for t in json.loads((tmp_path / "page.json").read_text())["tables"]}
    assert [row[0] for row in tables["Ours with one part taken away"]["rows"]] == drivers[:2]
    assert [row[0] for row in tables["Over all conditions"]["rows"]] == drivers
    options[3], page = ",".join(drivers[:2]), tmp_path / "32-parts.json"  # from the pieces that are there
    assert execute(["evaluate", *options, "--out", str(tmp_path), "--page", str(page)]) == 0
    written = json.loads(page.read_text())
    assert written["title"] == "What each part is worth"
    assert [figure["file"] for figure in written["figures"]] == ["parts-overall.png"]
    assert "What was aimed at" not in [t["title"] for t in written["tables"]]


@pytest.mark.slow
def test_evaluate_calibrates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--calibration", "--episodes", "4", "--workers", "1", "--out", str(tmp_path), "--json"]
    assert execute(["evaluate", *options]) == 0
    found = json.loads(capsys.readouterr().out)["calibration"]
    assert set(found) == {"in_model", "social_force", "goal_switch", "noise"}
    assert all(0 <= kind["ece"] <= 1 and kind["n"] > 0 for kind in found.values())
    assert (tmp_path / "calibration.png").stat().st_size > 10_000
    page = tmp_path / "page.json"
    assert execute(["evaluate", *options, "--page", str(page)]) == 0  # from the pieces that are there
    assert json.loads(capsys.readouterr().out)["calibration"] == found
    written = json.loads(page.read_text())
    assert len(written["tables"]) == 5
    assert all(len(row) == len(t["header"]) for t in written["tables"] for row in t["rows"])


@pytest.mark.parametrize(
    "command", [["evaluate", "--quick"], ["evaluate", "--calibration"], ["study", "goals"], "people"]
)
def test_the_cluster_that_was_named_does_the_work(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With --calibration or --people, and for a study, Ray was started on this machine whatever --address said."""
    if command == "people":
        rows = [f"s,{0.4 * k:.1f},{n},ped,{0.5 * k - 8:.1f},{n}" for n in (1, 2) for k in range(33)]
        tracks = tmp_path / "tracks.csv"
        tracks.write_text("\n".join(["scene,t,agent,kind,x,y", *rows]) + "\n")
        command = [
            "evaluate",
            "--people",
            str(tracks),
            "--studies",
            "replay",
            "--navigators",
            "sidestep",
            "--trips",
            "1",
        ]
    asked: list[str | None] = []

    def cluster(work: object, pieces: list[object], workers: int, address: str | None) -> NoReturn:
        asked.append(address)
        raise WorkersLost(len(pieces))

    monkeypatch.setattr("sidestep.studies.engines._with_ray", cluster)
    ray = ["--engine", "ray", "--address", "10.0.0.1:6379", "--out", str(tmp_path / "out")]
    assert execute([*command, *ray]) == FAILURE
    assert asked == ["10.0.0.1:6379"]


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["evaluate", "--fewer", "mpc:3", "--out", "OUT"], "NAME=COUNT"),
        (["evaluate", "--fewer", "social-force=3", "--out", "OUT"], "condition:social-force or navigator:social-force"),
        (["evaluate", "--episodes", "0", "--out", "OUT"], "episodes: got 0; allowed: an integer ≥ 1"),
        (["evaluate", "--calibration", "--episodes", "0", "--out", "OUT"], "episodes: got 0"),
        (["evaluate", "--trips", "3", "--out", "OUT"], "only together with --people"),
        (["evaluate", "--calibration", "--conditions", "straight", "--out", "OUT"], "only without --calibration"),
        (["evaluate", "--people", "no.csv", "--episodes", "3", "--out", "OUT"], "only without --people"),
        (["evaluate", "--people", "no.csv", "--studies", "replai", "--out", "OUT"], "did you mean 'replay'"),
        (["evaluate", "--people", "no.csv", "--studies", "replay", "--moments", "9", "--out", "OUT"], "with pred"),
        (["evaluate", "--people", "no.csv", "--studies", "replay", "--vehicle", "car", "--out", "OUT"], "with aw"),
        (["evaluate", "--people", "no.csv", "--studies", "replay", "--ablations", "--out", "OUT"], "or awareness"),
        (["evaluate", "--people", "no.csv", "--studies", "prediction", "--crowd", "9", "--out", "OUT"], "with replay"),
        (
            ["evaluate", "--people", "no.csv", "--studies", "awareness", "--navigators", "orca", "--out", "OUT"],
            "--navigators: got 'orca'; allowed: only with replay among --studies",
        ),
        (["evaluate", "--people", "no.csv", "--navigators", "orka", "--out", "OUT"], "orca"),
        (["evaluate", "--people", "no.csv", "--crowd", "0", "--out", "OUT"], "--crowd: got 0"),
        (["evaluate", "--conditions", "strait", "--out", "OUT"], "straight"),
        (
            ["evaluate", "--quick", "--address", "10.0.0.1:6379", "--out", "OUT"],
            "address: got '10.0.0.1:6379'; allowed: o",
        ),
        (["study", "goals", "--address", "10.0.0.1:6379", "--out", "OUT"], "only together with the engine ray"),
        (["reproduce", "--claims", "IV-A-shortr", "--out", "OUT"], "IV-A-shorter"),
        (["evaluate", "--fewer", "orca=²", "--out", "OUT"], "NAME=COUNT"),
        (["fit", "no.csv", "--most", "-1", "--out", "OUT/human.toml"], "--most: got -1; allowed: an integer ≥ 0"),
    ],
)
def test_a_misspelt_name_is_one_line_with_the_nearest(
    arguments: list[str], names: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute([a.replace("OUT", str(tmp_path)) for a in arguments]) == BAD_INPUT
    message = capsys.readouterr().err.strip()
    assert names in message
    assert "\n" not in message
