"""`--set`, `--json` and `--quiet`: from the command line into the step, and out for programs."""

import functools
import json
import re
import shlex
from pathlib import Path

import jax.numpy as jnp
import pytest

import jaxphys
from jaxphys.cli.main import COMMANDS, run
from jaxphys.cli.settings import with_settings
from jaxphys.core.errors import InputError

BALL = Path(__file__).parents[1] / "data" / "ball.ply"
SCENE = jaxphys.default_scene("jelly", spacing=0.15)


def test_what_is_set_reaches_the_step():
    ball = jaxphys.load(BALL)
    before, _ = jaxphys.build(SCENE, ball)
    modulus = before.model.parameters["youngs_modulus"].mean()
    changed = with_settings(
        SCENE,
        (
            f"youngs_modulus={4 * float(modulus)}",
            "objects.0.parameters.density=100",
            "velocity=[0.0, 0.5, -2]",
            "boundaries.0.friction=0.25",
            "gravity=[0, 0, -1.62]",
            "filling.show=false",
            "domain.spacing=0.15",
        ),
    )
    simulation, look = jaxphys.build(changed, ball)
    model, state = simulation.model, simulation.state
    assert jnp.allclose(model.parameters["youngs_modulus"], 4 * modulus)
    assert float(model.mass.sum()) == pytest.approx(float(before.model.mass.sum()) / 3, rel=1e-5)
    assert jnp.allclose(state.velocity, jnp.array([[0.0], [0.5], [-2.0]]))
    assert model.gravity.tolist() == pytest.approx([0, 0, -1.62])
    # Four times the stiffness over a third of the density (300): a wave is as fast as that.
    assert before.dt / simulation.dt == pytest.approx(12**0.5, rel=0.1)
    assert float(model.boundaries[0].friction) == pytest.approx(0.25)
    assert look.gaussians.count < simulation.config.particles


@pytest.mark.parametrize(
    "setting, told",
    [
        ("youngs_modulus", r"^--set youngs_modulus: give a name and a value"),
        ("youngs_module=1", r"^--set youngs_module: unknown key .*mean 'youngs_modulus'"),
        (
            "objects.0.parameters.young=1",
            r"^--set: objects\[0\]\.parameters: jelly: unknown .*young",
        ),
        ("objects.1.velocity=[0,0,0]", r"^--set objects.1.velocity: '1' is no number below 1"),
        ("gravity.x.y=1", r"^--set gravity.x.y: 'x' is no number below 3"),
        ("frames.many=1", r"^--set frames.many: frames is one value"),
        ("frames=0", r"^--set frames: frames: "),
        ("youngs_modulus=-1", r"^--set: objects\[0\].*youngs_modulus"),
        ("velocity=fast", r"^--set velocity: objects\[0\]\.velocity: expected .*fast"),
        ("stepping.theta=1", r"^--set stepping.theta: stepping.*type"),
    ],
)
def test_what_cannot_be_set_is_told_by_its_name(setting, told):
    with pytest.raises(InputError, match=told):
        with_settings(SCENE, (setting,))


def test_programs_read_what_was_made(tmp_path, capsys):
    out = tmp_path / "run"
    words = ["animate", str(BALL), "--out", str(out), "--quiet", "--json"]
    small = ["domain.spacing=0.2", "width=32", "height=32", "frames=2", "density=500"]
    for setting in small:
        words += ["--set", setting]
    assert run(words) == 0
    told = capsys.readouterr()
    assert told.err == ""
    made = json.loads(told.out)
    assert made["folder"] == str(out) and "motion.mp4" in made["files"]
    assert made["last_frame"]["frame"] == 1 and made["last_frame"]["steps"] > 0
    written = json.loads((out / "config.json").read_text())
    assert written["objects"][0]["parameters"] == {"density": 500}
    # 500 instead of 300 kg/m^3.
    heavier = with_settings(SCENE, tuple(small[:1]))
    simulation, _ = jaxphys.build(heavier, jaxphys.load(BALL))
    assert made["last_frame"]["mass"] == pytest.approx(
        5 / 3 * float(simulation.model.mass.sum()), rel=1e-4
    )


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example(command, capsys):
    """That of a command with actions stands at each of them."""
    actions = {"study": ("make", "analyse"), "weights": ("list", "path", "fetch", "verify")}
    for action in actions.get(command, ((),)):
        words = [command, *([action] if action else [])]
        with pytest.raises(SystemExit):
            run([*words, "--help"])
        assert f"For example: jaxphys {' '.join(words)}" in capsys.readouterr().out


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - {"study", "weights"}))
def test_the_example_of_a_help_is_understood(command, capsys, monkeypatch):
    """As it is printed, word for word; what the command then does is left out."""
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        run([command, "--help"])
    (example,) = re.findall(r"For example: (jaxphys .*?)\s*│?\n", capsys.readouterr().out)
    called = []

    @functools.wraps(COMMANDS[command])
    def instead(*arguments, **options):
        called.append(arguments)
        return 0

    monkeypatch.setitem(COMMANDS, command, instead)
    assert run(shlex.split(example)[1:]) == 0
    assert len(called) == 1


def test_shells_can_complete(capsys):
    with pytest.raises(SystemExit) as ended:
        run(["--tyro-print-completion", "bash"])
    assert not ended.value.code
    assert "animate" in capsys.readouterr().out
