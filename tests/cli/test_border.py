"""Where errors become lines: exit statuses, and what reaches the terminal."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from jaxphys.cli import main as border
from jaxphys.cli.main import run


def jaxphys(*arguments, stdout=subprocess.PIPE, **environment):
    return subprocess.run(
        [sys.executable, "-m", "jaxphys", *map(str, arguments)],
        stdout=stdout, stderr=subprocess.PIPE, text=True, env=os.environ | environment, timeout=120,
    )  # fmt: skip


@pytest.fixture
def failing(monkeypatch):
    """Makes `jaxphys materials` raise something."""

    def fail(error):
        def listing(**_):
            raise error

        monkeypatch.setattr("jaxphys.cli.listing.materials_text", listing)

    return fail


def test_what_nobody_foresaw_is_one_line_and_status_1(failing, capsys):
    error = KeyError("\x1b[31mx")
    error.add_note("while reading a.ply")
    failing(error)
    assert run(["materials"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].isprintable()
    assert lines[0].startswith("jaxphys: unexpected KeyError while reading a.ply: ")
    assert "--traceback" in lines[0] and "report" in lines[0]


@pytest.mark.parametrize("place", [0, 1])
def test_a_traceback_is_shown_on_request_wherever_that_stands(failing, capsys, place):
    failing(KeyError("x"))
    arguments = ["materials"]
    arguments.insert(place, "--traceback")
    assert run(arguments) == 1
    told = capsys.readouterr().err
    assert "Traceback" in told and told.splitlines()[-1].startswith("jaxphys: unexpected")


def test_a_traceback_of_a_refusal(capsys):
    assert run(["render", "none.ply", "--out", "none.png", "--traceback"]) == 2
    told = capsys.readouterr().err
    assert "Traceback" in told and told.splitlines()[-1] == "jaxphys: none.ply: no such file"


def test_memory_and_disk_are_for_the_user_to_mend(failing, capsys):
    failing(MemoryError())
    assert run(["materials"]) == 2
    failing(OSError(28, "No space left on device", "a.ply"))
    assert run(["materials"]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "jaxphys: there is not enough memory for this; ask for less at a time",
        "jaxphys: a.ply: No space left on device",
    ]


def test_escapes_out_of_a_file_do_not_reach_the_terminal(tmp_path, capsys):
    path = tmp_path / "a.json"
    path.write_text('{"objects": [{"\\u001b[31m' + "x" * 5000 + '": 1}]}')
    assert run(["animate", "a.ply", "--config", str(path), "--out", "none"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.isprintable() and str(path) in line and len(line) <= 310


def test_a_second_interrupt_is_quiet(monkeypatch):
    """It comes while the first one is being told."""
    before = signal.getsignal(signal.SIGINT)

    def interrupted(arguments=None):
        raise KeyboardInterrupt

    monkeypatch.setattr(border, "run", interrupted)
    monkeypatch.setattr(border.warnings, "simplefilter", lambda _: None)
    try:
        with open(os.devnull, "w") as nowhere, pytest.raises(SystemExit) as stop:
            monkeypatch.setattr(sys, "stdout", nowhere)
            monkeypatch.setattr(sys, "stderr", nowhere)
            border.main()
        assert stop.value.code == 130
        # A third one ends the process without a word of Python's.
        assert signal.getsignal(signal.SIGINT) == signal.SIG_DFL
    finally:
        signal.signal(signal.SIGINT, before)


def test_nobody_reads_any_more():
    reader, writer = os.pipe()
    os.close(reader)
    done = jaxphys("materials", stdout=writer)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a disk that is full")
def test_a_full_disk_under_the_output():
    with open("/dev/full", "w") as full:
        done = jaxphys("materials", stdout=full)
    assert done.returncode == 2
    assert done.stderr.splitlines() == ["jaxphys: No space left on device"]


def test_a_terminal_that_knows_ascii_only(tmp_path):
    path = tmp_path / "é\x1b.ply"
    ascii_only = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    done = jaxphys("render", path, "--out", tmp_path / "a.png", **ascii_only)
    assert done.returncode == 2 and done.stderr.isascii()
    assert done.stderr.startswith("jaxphys: ") and done.stderr.endswith("no such file\n")
    assert jaxphys("--help", **ascii_only).returncode == 0


def test_a_platform_that_is_not_there(tmp_path):
    done = jaxphys("doctor", JAX_PLATFORMS="abacus")
    assert done.returncode == 1 and done.stdout.startswith("FAIL jax") and not done.stderr
    ball = Path(__file__).parents[1] / "data" / "ball.ply"
    done = jaxphys("render", ball, "--out", tmp_path / "a.png", JAX_PLATFORMS="abacus")
    assert done.returncode == 2
    assert done.stderr.startswith("jaxphys: JAX_PLATFORMS='abacus': JAX finds no device")
    assert len(done.stderr.splitlines()) == 1
