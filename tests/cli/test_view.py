"""`jaxphys view`: what it refuses, in a line, before any work."""

import sys

import pytest

from jaxphys.cli.main import run

BALL = "tests/data/ball.ply"


def refused(capsys, *arguments):
    assert run(["view", *arguments, "--no-open"]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line


def test_without_viser_it_says_what_to_install(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert "jaxphys-splats[viewer]" in refused(capsys, BALL)


def test_what_is_not_there_is_told_before_what_is_not_installed(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert "nope.ply: no such file" in refused(capsys, "nope.ply")


@pytest.mark.parametrize(
    ("option", "value"), [("--port", "70000"), ("--nodes", "100"), ("--splats", "0")]
)
def test_numbers_out_of_range_are_named(capsys, option, value):
    assert option in refused(capsys, BALL, option, value)


def test_a_finished_run_is_not_made_of_something_else(capsys, tmp_path):
    (tmp_path / "motion.mp4").write_bytes(b"")
    assert "config.json" in refused(capsys, str(tmp_path), "--material", "sand")


def test_a_folder_that_is_no_run_is_refused_at_once(capsys, tmp_path):
    pytest.importorskip("viser", reason="VISER IS NOT INSTALLED: no server was started")
    (tmp_path / "motion.mp4").write_bytes(b"")
    assert "config.json" in refused(capsys, str(tmp_path))
