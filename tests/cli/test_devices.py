import json
import os
import subprocess
import sys

import pytest

from jaxphys.cli.devices import cores, without_devices
from jaxphys.cli.main import run
from jaxphys.core.errors import InputError


@pytest.mark.parametrize(
    ("words", "rest", "number"),
    [
        (["plan", "s.json"], ["plan", "s.json"], None),
        (["plan", "--devices", "3", "s.json"], ["plan", "s.json"], 3),
        (["--devices=2", "plan"], ["plan"], 2),
    ],
)
def test_the_number_of_devices_is_taken_from_anywhere(words, rest, number):
    assert without_devices(words) == (rest, number)


@pytest.mark.parametrize("words", [["--devices"], ["--devices", "0"], ["--devices=two"]])
def test_what_is_no_number_is_refused(words):
    with pytest.raises(InputError, match="--devices: expected a number"):
        without_devices(words)


def test_more_than_there_are_cores_is_one_line(capsys):
    assert run(["materials", "--devices", str(cores() + 1)]) == 2
    assert capsys.readouterr().err == (
        f"jaxphys: --devices: {cores() + 1} devices, but this process may use {cores()} cores\n"
    )


@pytest.mark.parametrize("number", sorted({1, min(2, cores())}))
def test_a_command_runs_on_as_many(number, tmp_path):
    """`plan` says on how many devices a run would be."""
    (tmp_path / "scene.json").write_text(json.dumps({"frames": 2}))
    environment = {k: v for k, v in os.environ.items() if k != "JAX_NUM_CPU_DEVICES"}
    command = [sys.executable, "-m", "jaxphys", "plan", "scene.json", "--no-measure"]
    command += ["--devices", str(number)]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert f"devices: {number}" in done.stdout
