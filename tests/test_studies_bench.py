"""The bench on small cases: what it prints is complete, its figures are there, and its parts say what they measure."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sidestep.cli import execute
from sidestep.commands import bench as command
from sidestep.studies import bench, bench_floor


@pytest.mark.parametrize("case", bench.CASES, ids=lambda case: case.name)
def test_every_case_is_planned_for_and_certified_or_says_why(case: bench.Case) -> None:
    small = replace(case, horizon=3, people=min(case.people, 3))
    planner = bench._planner(small)
    assert (planner.obstacles is not None) == case.doorway
    timing = bench.time_case(small, steps=5)
    assert timing.times.shape == (5,)
    assert 0 < timing.median <= timing.p95


def test_the_robot_gets_through_the_doorway() -> None:
    case = next(case for case in bench.CASES if case.doorway)
    planner = bench._planner(case)
    seen: list[tuple[float, float]] = []
    step = planner.step

    def spied(**given: object) -> object:
        seen.append(tuple(given["robot"].position))  # type: ignore[attr-defined]
        return step(**given)  # type: ignore[arg-type]

    planner.step = spied  # type: ignore[method-assign, assignment]
    bench._encounter(planner, case, np.random.default_rng(0), length=40)
    places = np.array(seen)
    through = places[np.abs(places[:, 1] - 2.1) < 0.6]
    assert len(through) > 0
    assert (np.abs(through[:, 0]) < 0.8).all()
    assert places[-1] == pytest.approx([0.0, 5.0], abs=0.2)


def test_exponents_are_those_of_power_laws() -> None:
    found = bench.exponents({"square": [(n, 3.0 * n**2) for n in (2, 4, 9)], "flat": [(1, 2.0), (8, 2.0)]})
    assert found["square"] == pytest.approx(2.0)
    assert found["flat"] == pytest.approx(0.0, abs=1e-9)


def test_overruns_count_what_is_later_than_the_deadline() -> None:
    assert bench.deadline_overruns(deadline=60.0, horizon=2, steps=6)["share"] == 0.0
    late = bench.deadline_overruns(deadline=1e-6, horizon=2, steps=6)
    assert late["share"] == 1.0
    assert late["worst_ms"] > 0.0


def test_floors_and_work_grow_with_the_horizon() -> None:
    limits = bench_floor.ceilings(repeats=1)
    few, many = (bench_floor.kernel_work(n, limits, repeats=1) for n in (3, 6))
    assert set(few) == set(many)
    for name, entry in few.items():
        assert many[name]["flop"] > entry["flop"] > 0
        assert entry["fraction"] == pytest.approx(entry["floor_ms"] / entry["ms"])
    sweep = bench_floor.floor_fraction(6, limits, repeats=1)
    assert sweep["fraction"] == pytest.approx(sweep["floor_ms"] / sweep["ms"])


@pytest.mark.slow
def test_bench_prints_one_json_object_and_draws_its_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    small = tuple(replace(case, people=min(case.people, 2)) for case in bench.CASES if case.horizon <= 20)
    monkeypatch.setattr(bench, "CASES", small)
    monkeypatch.setattr(bench, "time_case", lambda case, **_: bench.Timing(
        name=case.name, target=case.target, times=np.full(3, float(case.horizon))
    ))  # fmt: skip
    monkeypatch.setattr(bench, "thread_ratios", lambda *, encounters: {"one_thread_over_two_ten_people_n10": 1.5})
    monkeypatch.setattr(bench, "deadline_overruns", lambda *, deadline, horizon, steps: {
        "deadline_ms": 1e3 * deadline, "horizon": horizon, "steps": steps, "share": 0.0, "worst_ms": 0.0
    })  # fmt: skip
    monkeypatch.setattr(command, "_scipy_times", lambda quick: {1: 2.0})
    monkeypatch.setattr(command, "_other_cases", list)
    page = tmp_path / "page.json"
    assert execute(["bench", "--quick", "--out", str(tmp_path), "--page", str(page), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [c["name"] for c in result["cases"]] == [case.name for case in small]
    assert all({"name", "median_ms", "p95_ms", "target_ms"} <= set(c) for c in result["cases"])
    assert result["over_horizon"] == {"N": [5, 10, 15, 20], "ms": [5.0, 10.0, 15.0, 20.0]}
    assert result["ratios"]["scipy_over_sidestep_n1"] == pytest.approx(2.0)
    assert {"machine", "floor_fraction", "exponents", "deadline", "kernels"} <= set(result)
    assert len(result["figures"]) == 4
    assert all(Path(figure).stat().st_size > 5_000 for figure in result["figures"])
    written = json.loads(page.read_text())
    assert all(len(row) == len(t["header"]) for t in written["tables"] for row in t["rows"])
    assert execute(["bench", "--quick", "--out", str(tmp_path)]) == 0
    assert small[0].name in capsys.readouterr().out
