"""`sidestep reproduce` from end to end with very few seeds: table, figures, page, and what is kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sidestep.cli import execute
from sidestep.commands import reproduce as command
from sidestep.studies.paper import sweep


@pytest.fixture
def few_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("FULL_SEEDS", "QUICK_SEEDS", "SWEEP_SEEDS"):
        monkeypatch.setattr(command, name, 2)
    monkeypatch.setattr("sidestep.studies.paper.sweep", lambda: sweep()[:2])


def run(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    assert execute(["reproduce", "--workers", "1", "--json", *arguments]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.slow
@pytest.mark.usefixtures("few_seeds")
def test_two_claims_make_a_table_figures_and_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, page = tmp_path / "out", tmp_path / "docs" / "reproduction.md"
    found = run(["--claims", "IV-B-nonpredictive-falls,V-narrows", "--out", str(out), "--page", str(page)], capsys)
    claims = found["claims"]
    assert isinstance(claims, list)
    assert {row["id"] for row in claims} == {"IV-B-nonpredictive-falls", "V-narrows"}
    assert json.loads((out / "results.json").read_text())["claims"] == claims
    assert all("of 2 places around" in row["holds_when"] for row in claims if "falls" in row["id"])
    assert {file.name.split("--")[0] for file in (out / "points").iterdir()} == {
        "lab-printed",
        "lab-meeting",
        "paper-printed",
        "paper-authors",
    }

    figures = found["figures"]
    assert isinstance(figures, list)
    assert {Path(f).stem for f in figures} >= {"comparison-printed", "lab-authors", "reasons", "regions"}
    assert all(Path(f).stat().st_size > 5_000 for f in figures)
    text = page.read_text()
    assert (
        text.count("| [IV-B-nonpredictive-falls](#iv-b-nonpredictive-falls) (") == 2
    )  # one line for each definition of PI
    assert "## V-narrows\n" in text
    for figure in figures:
        assert figure.endswith(".pdf") or f"](reproduction/{Path(figure).name})" in text
        assert figure.endswith(".pdf") or (page.parent / "reproduction" / Path(figure).name).is_file()

    again = run(["--claims", "IV-B-nonpredictive-falls,V-narrows", "--out", str(out)], capsys)
    assert again["claims"] == claims
    assert float(str(again["seconds"])) > float(str(found["seconds"]))  # of all runs that what is kept took
