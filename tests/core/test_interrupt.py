"""Ctrl-C: the first waits for a good moment, the second does not, and both leave files whole."""

import os
import signal
import subprocess
import sys

import pytest

from jaxphys.core.interrupt import deferred_interrupt

PROGRAM = """
import os, signal, sys
import numpy as np
import jaxphys.cli.main as cli
from jaxphys.core.files import atomic_path
from jaxphys.core.run_folder import run_folder
from jaxphys.core.interrupt import deferred_interrupt
from jaxphys.pipeline.video import VideoWriter

def command(folder: str) -> int:
    with run_folder(folder, "one", ["a.mp4", "b.txt"]) as out:
        out.file("b.txt").write_text("whole")
        with atomic_path(out.file("a.mp4")) as aside, deferred_interrupt() as interrupted:
            with VideoWriter(aside, 64, 48, 12.0) as video:
                for index in range(10**6):
                    video.add(np.zeros((48, 64, 3), np.uint8))
                    if index in (20, 30):
                        os.kill(os.getpid(), signal.SIGINT)
                    assert not interrupted() or index >= 20
    return 0

cli.COMMANDS["doctor"] = lambda: command(sys.argv[1])
sys.argv[1:] = [sys.argv[1]]
status = cli.run(["doctor"])
sys.exit(status)
"""


def test_the_first_waits_and_the_second_does_not():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), deferred_interrupt() as interrupted:
        assert not interrupted()
        os.kill(os.getpid(), signal.SIGINT)
        assert interrupted()
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError
    assert signal.getsignal(signal.SIGINT) is before


def test_what_comes_after_the_second_does_not_disturb_the_tidying():
    tidied = []
    with pytest.raises(KeyboardInterrupt), deferred_interrupt():
        try:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)
        finally:
            os.kill(os.getpid(), signal.SIGINT)
            tidied.append(True)
    assert tidied


def test_the_second_ends_the_command_with_one_line_and_whole_files(tmp_path):
    """In the middle of encoding; the encoder ends too, and nothing is left aside."""
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, out], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 130, done.stderr
    assert done.stderr.splitlines() == ["jaxphys: interrupted; the same command resumes"]
    left = sorted(path.name for path in out.iterdir())
    assert left == [".jaxphys-run", "b.txt"] and (out / "b.txt").read_text() == "whole"
