"""Every code block and command of the documentation runs; every public name is documented where it is promised."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import json
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from functools import cached_property
from pathlib import Path

import pytest
from cyclopts import App

import sidestep
from sidestep.cli import COMMANDS, execute

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
sys.path.insert(0, str(ROOT / "tools"))

from document_blocks import blocks, in_shell, run_page  # noqa: E402

WITH_BLOCKS = [page for page in PAGES if blocks(page.read_text(encoding="utf-8"))]


def here(command: str) -> int:
    """Run a plain `sidestep` command in this process, which has everything loaded already; any other in a shell."""
    words = shlex.split(command)
    return execute(words[1:]) if words[0] == "sidestep" and not set(command) & set("|&;<>$`*?") else in_shell(command)


@pytest.mark.slow
@pytest.mark.no_cover  # whole runs: what they consist of is covered by its own tests
@pytest.mark.parametrize("page", WITH_BLOCKS, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_blocks_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run_page(page, tmp_path, run=here) > 0


@pytest.mark.slow
@pytest.mark.no_cover  # as above
@pytest.mark.parametrize("script", sorted((ROOT / "examples").glob("[0-9]*.py")), ids=lambda script: script.stem)
def test_an_example_runs_and_leaves_its_picture(script, tmp_path, monkeypatch, capsys):
    if script.stem.endswith("learning_environment"):
        pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    runpy.run_path(str(script), run_name="__main__")
    assert capsys.readouterr().out.strip()
    assert [p.name for p in tmp_path.iterdir()] == [f"{script.stem}.png"]


def test_the_base_with_two_wheels_is_said_to_arrive_when_its_point_does(tmp_path, monkeypatch, capsys):
    """Its axle stays behind the point that is planned; the loop of 20 s had gone on to its end beside the goal."""
    script = ROOT / "examples" / "03_custom_robot.py"
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    runpy.run_path(str(script), run_name="__main__")
    found = re.match(r"arrived after ([\d.]+) s", capsys.readouterr().out)
    assert found is not None
    assert float(found.group(1)) < 15.0


def test_there_are_ten_examples_with_a_title_and_words():
    scripts = sorted((ROOT / "examples").glob("[0-9]*.py"))
    assert len(scripts) >= 10
    for script in scripts:
        source = script.read_text(encoding="utf-8")
        words = ast.get_docstring(ast.parse(source)) or ""
        assert len(words.splitlines()) >= 3, script.name
        assert len(source.splitlines()) <= 100, script.name


def test_a_failing_block_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    for text in (
        "```python\nassert False\n```\n",
        "```console\n$ false\n```\n",
        "```console\n$ no-such-command\n```\n",
    ):
        page.write_text(text)
        command = [sys.executable, str(ROOT / "tools" / "document_blocks.py"), str(page)]
        assert subprocess.run(command, capture_output=True, check=False).returncode != 0, text
    page.write_text("<!-- not run: it would fail -->\n" + text + "\nplain ```python``` words\n")
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize("name", sidestep.__all__)
def test_a_public_name_is_in_the_reference(name):
    reference = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    assert f"::: sidestep.{name}\n" in reference + "\n"


@pytest.mark.parametrize("name", sidestep.__all__)
def test_a_public_name_says_what_it_is(name):
    thing = getattr(sidestep, name)
    doc = inspect.getdoc(thing) or ""
    assert len(doc) > 20, name
    if dataclasses.is_dataclass(thing):
        for field in dataclasses.fields(thing):
            assert re.search(rf"\b{field.name}\b", doc), f"{name}.{field.name} is not in the docstring"
    if inspect.isclass(thing) and not issubclass(thing, BaseException):
        for key, member in vars(thing).items():
            if not key.startswith("_") and (
                inspect.isroutine(member) or isinstance(member, property | cached_property)
            ):
                assert inspect.getdoc(getattr(thing, key)), f"{name}.{key} has no docstring"


def test_every_field_of_a_scenario_has_a_meaning_on_its_page():
    sys.path.insert(0, str(ROOT / "tools" / "site"))
    from scenario_page import TABLES, scenario_page

    page = scenario_page()
    assert '`"none"`' in page  # in words that a file may hold
    assert "≤ 1e+09" not in page
    assert not re.findall(r"^\| `\w+` \|[^|]*\| *\|$", page, re.MULTILINE)
    for _, _, model in TABLES:
        names = getattr(model, "model_fields", None) or [f.name for f in dataclasses.fields(model)]
        assert all(f"\n| `{name}` | " in page for name in names)


def test_the_notation_table_names_things_that_exist():
    page = (ROOT / "docs" / "notation.md").read_text(encoding="utf-8")
    for owner, field in set(re.findall(r"`([A-Z]\w+)\.(\w+)`", page)):
        home = getattr(sidestep, owner, None) or _inner(owner)
        fields = {f.name for f in dataclasses.fields(home)} if dataclasses.is_dataclass(home) else set()
        assert field in fields or hasattr(home, field), f"{owner}.{field}"
    for module in set(re.findall(r"`(sidestep(?:\.\w+)+)`", page)):
        __import__(module)


def _inner(owner: str) -> type:
    from sidestep.human.actions import ActionSet
    from sidestep.simulation.metrics import Metrics

    return {"ActionSet": ActionSet, "Metrics": Metrics}[owner]


RESULTS = sorted((ROOT / "docs" / "evidence" / "results").glob("*.json"))


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_the_command_of_a_page_of_evidence_has_options_that_there_are(page):
    program, *arguments = shlex.split(json.loads(page.read_text())["command"])
    if program == "python":
        assert (ROOT / arguments[0]).is_file()
        return
    assert program == "sidestep"
    app = App(name="sidestep", version_flags=())
    app.command(COMMANDS[arguments[0]][0], name=arguments[0])
    _, _, ignored = app.parse_args(arguments, exit_on_error=False, print_error=False)
    assert not ignored


def test_the_software_and_its_methods_can_be_cited(capsys):
    assert execute(["cite"]) == 0
    out = capsys.readouterr().out
    assert "Amiri" in out
    assert sidestep.__version__ in out
    assert execute(["cite", "all"]) == 0
    entries = capsys.readouterr().out.split("\n\n")
    assert len(entries) >= 8
    assert all(entry.count("{") == entry.count("}") and entry.startswith("@") for entry in entries)
    everything = "\n\n".join(entries)
    assert execute(["cite", "method", "all"]) == 0
    assert capsys.readouterr().out == everything
    assert execute(["cite", "orca", "orca"]) == 0
    assert capsys.readouterr().out.count("@") == 1
    assert execute(["cite", "orcaa"]) == 2
    assert "did you mean 'orca'" in capsys.readouterr().err


def test_versions_agree():
    cff = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"\nversion: {sidestep.__version__}\n" in cff
    assert project["version"] == sidestep.__version__


def test_the_page_of_the_laboratory_says_what_was_measured_last():
    rows = json.loads((ROOT / "docs" / "evidence" / "results" / "74-laboratory.json").read_text())["tables"][0]["rows"]
    page = (ROOT / "docs" / "start" / "lab.md").read_text()
    for scans in ("scans at once", "200 ms late, 20 % lost"):
        told = [row[5].split(" %")[0] for row in rows if row[0] == scans]
        moving, standing = (sum(int(row[3].split(" / ")[i]) for row in rows if row[0] == scans) for i in (0, 1))
        line = next(line for line in page.splitlines() if line.startswith(f"| {scans} |"))
        assert f"({told[0]} %, {told[1]} %)" in line
        assert f"| {sum(map(int, told)) / 2:.0f} % (" in line
        assert f"| {moving} / {standing} |" in line
