"""The command line itself: overview, errors in one line, exit status, nothing heavy before it is needed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sidestep.cli import COMMANDS, execute


def test_the_overview_names_every_command(capsys):
    for argv in ([], ["--help"], ["-h"], ["help"]):
        assert execute(argv) == 0
        out = capsys.readouterr().out
        for name, (_, text) in COMMANDS.items():
            assert f"  {name} " in out
            assert text in out


def test_the_overview_imports_nothing_heavy():
    heavy = ("numpy", "numba", "pydantic", "matplotlib", "cyclopts", "rich", "scipy")
    code = (
        "import sys; from sidestep.cli import execute; execute(['--help']); "
        f"print([name for name in {heavy!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", list(COMMANDS))
def test_every_command_explains_itself(name, capsys):
    assert execute([name, "--help"]) == 0
    assert f"sidestep {name}" in capsys.readouterr().out


def test_version(capsys):
    from sidestep import __version__

    assert execute(["--version"]) == 0
    assert capsys.readouterr().out == f"sidestep {__version__}\n"


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["rnu"], "did you mean 'run'"),
        (["run", "--sed", "3"], "Did you mean --seed"),
        (["run", "--seed", "three"], "--seed"),
        (["run", "--seed", "1.5"], "--seed: got '1.5'; allowed: an integer"),
        (["run", "--horizon", "2.5"], "--horizon"),
        (["lab", "--kinematic", "--seeds", "0.6"], "--seeds"),
        (["run", "--seed"], "--seed"),
        (["run", "--human", "asleep"], "concerned"),
        (["run", "crossing", "head-on"], "head-on"),
        (["scenarios", "crosing"], "did you mean 'crossing'"),
    ],
)
def test_bad_arguments_give_one_line_and_status_2(argv, words, capsys):
    assert execute(argv) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert err.startswith("sidestep: ")
    assert words in err


def test_a_fault_of_ours_has_status_1_and_a_traceback(capsys, monkeypatch):
    import sidestep.io.scenarios

    def broken():
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr(sidestep.io.scenarios, "shipped_names", broken)
    assert execute(["scenarios"]) == 1
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert "fault of sidestep's own" in err.splitlines()[-1]


def test_an_interruption_is_told_in_one_line(capsys, monkeypatch):
    import sidestep.io.scenarios

    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(sidestep.io.scenarios, "shipped_names", interrupted)
    assert execute(["scenarios"]) == 130
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "sidestep: interrupted\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux only")
@pytest.mark.parametrize("arguments", [["scenarios", "crossing"], ["scenarios", "--json"], ["--version"]])
def test_output_on_a_full_disk_is_told_in_one_line(arguments):
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "sidestep", *arguments]
        told = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert told.stderr == "sidestep: output: cannot be written (No space left on device)\n"
    assert told.returncode == 2


def test_scenarios_are_listed_and_printed(capsys):
    assert execute(["scenarios"]) == 0
    assert "crossing" in capsys.readouterr().out
    assert execute(["scenarios", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["scenarios"]
    assert {"crossing", "head-on", "paper-printed"} <= {entry["name"] for entry in listed}
    assert execute(["scenarios", "crossing"]) == 0
    text = capsys.readouterr().out
    assert "[robot]" in text
    assert execute(["scenarios", "crossing", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["toml"].strip() == text.strip()


def test_the_installed_command_and_the_module_are_the_same():
    done = subprocess.run([sys.executable, "-m", "sidestep", "rnu"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert "did you mean 'run'" in done.stderr


@pytest.mark.parametrize("argv", [["--help"], ["--version"], ["cite", "all"], ["run", "--help"], ["scenarios"]])
def test_who_reads_no_further_gets_no_traceback(argv):
    code = f"import sys; from sidestep.cli import execute; sys.exit(execute({argv!r}))"
    reading, writing = os.pipe()
    os.close(reading)  # nobody reads at all
    done = subprocess.run([sys.executable, "-c", code], stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert done.stderr == ""
    assert done.returncode == 0


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize("arguments", ["--version", "scenarios", "run --help"])
def test_closed_streams_are_no_fault(closed, arguments):
    told = subprocess.run(f"{sys.executable} -m sidestep {arguments} {closed}", shell=True, check=False, timeout=60)
    assert told.returncode == 0


@pytest.mark.parametrize(("encoding", "expected"), [("ascii", b"\\u2013 \\xe4"), ("latin-1", b"\\u2013 \xe4")])
def test_what_an_encoding_lacks_is_escaped(encoding, expected):
    code = "import sys; from sidestep import cli; cli.execute = lambda _: print('\u2013 \xe4'); cli.main()"
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=environment)
    assert told.stdout.strip() == expected


def test_a_terminal_of_one_column_shows_help_all_the_same():
    environment = {**os.environ, "COLUMNS": "1"}
    command = [sys.executable, "-m", "sidestep", "run", "--help"]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, timeout=60)
    assert "Send a robot past" in told.stdout
