"""PhysGaussian's six example configurations, from the file into the first steps."""

import json
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxphys.gaussians.gaussians import from_points
from jaxphys.mpm.loop.rollout import step
from jaxphys.scene.build import build
from jaxphys.scene.physgaussian import from_physgaussian

CONFIGS = Path(__file__).parent.parent / "data" / "physgaussian"
CELLS = 16


def start(name):
    """Scene, positions at rest and velocities (N, 3) after two steps of a ball of 250 Gaussians."""
    config = json.loads((CONFIGS / f"{name}.json").read_text()) | {"n_grid": CELLS}
    config["frame_dt"] = 2 * config["substep_dt"]
    if "particle_filling" in config:
        config["particle_filling"] |= {"n_grid": CELLS, "max_particles_num": 100}
    loaded = from_physgaussian(config, name)
    points = np.random.default_rng(0).normal(size=(250, 3))
    points *= (
        0.5
        * np.linspace(0.1, 1, 250)[:, None] ** (1 / 3)
        / np.linalg.norm(points, axis=1, keepdims=True)
    )
    gaussians = from_points(points.astype(np.float32), np.full((250, 3), 0.5, np.float32), 0.05)
    made, _ = build(loaded.scene, gaussians, dtype=np.float32)
    assert made.steps == 2
    state = made.state
    advance = jax.jit(step, static_argnums=0)
    for _ in range(made.steps):
        state = advance(made.config, made.model, state, made.dt)
    assert np.isfinite(np.asarray(state.position)).all()
    return loaded, *(np.asarray(a, np.float64).T for a in (made.state.position, state.velocity))


def test_ficus_is_pushed_and_its_pot_is_held():
    loaded, x, v = start("ficus")
    pot, crown = x[:, 2] < 0.6, x[:, 2] > 1.1
    np.testing.assert_allclose(v[pot], 0, atol=1e-7)
    assert np.all(v[crown, 0] < -1e-5) and np.abs(v[crown, 1:]).max() < 1e-3 * -v[crown, 0].max()
    assert loaded.scene.objects[0].regions[0].parameters["density"] == 70


def test_the_sofa_is_held():
    _, x, v = start("pillow2sofa")
    np.testing.assert_array_equal(v[x[:, 2] < 0.89], 0)
    falling = (x[:, 2] > 0.93) & (x[:, 2] < 0.95)
    assert np.all(v[falling, 2] < 0)


def test_the_planes_nose_turns_and_its_tail_is_held():
    """By -scale n x r: about x from y to -z."""
    _, x, v = start("plane")
    arm = x - [0.7, 1.03, 0.98]
    turned = (np.abs(arm[:, 0]) < 0.119) & (np.hypot(arm[:, 1], arm[:, 2]) < 0.599)
    assert 10 < turned.sum() < 200
    expected = np.stack([0 * arm[:, 0], arm[:, 2], -arm[:, 1]], 1)
    np.testing.assert_allclose(v[turned], expected[turned], atol=1e-3)
    np.testing.assert_array_equal(v[x[:, 0] > 1.21], 0)


def test_the_bread_is_pulled_both_ways():
    loaded, x, v = start("tear_bread")
    assert loaded.scene.objects[0].filling.show
    assert x[:, 1].max() - x[:, 1].min() < 0.61
    for side in (-1, 1):
        end = side * (x[:, 1] - 1) > 0.22
        assert 0.05 < side * v[end, 1].mean() < 0.2


def test_the_vase_turns_and_its_mouth_is_held():
    loaded, x, v = start("vasedeck")
    arm = x - [1, 1, 0.7]
    turned = (np.abs(arm[:, 2]) < 0.199) & (np.hypot(arm[:, 0], arm[:, 1]) < 0.349)
    expected = 1.9 * np.stack([arm[:, 1], -arm[:, 0], 0 * arm[:, 0]], 1)
    np.testing.assert_allclose(v[turned], expected[turned], atol=1e-3)
    assert turned.sum() > 10
    assert [entry.angular_velocity for entry in loaded.scene.boundaries[:4]] == [-1.9, 0, 1.9, 0]


def test_the_wolf_is_held_but_for_where_it_is_let_go():
    loaded, x, v = start("wolf")
    assert loaded.scene.splats_follow == "elastic" and loaded.scene.objects[0].filling.show
    held = (x[:, 0] > 0.5) & (x[:, 0] < 1.499)
    assert held.sum() > 200
    np.testing.assert_array_equal(v[held], 0)


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.json")), ids=lambda path: path.stem)
def test_every_example_loads_as_it_is(path):
    loaded = from_physgaussian(json.loads(path.read_text()), str(path))
    assert loaded.scene.domain.shape[0] in (50, 100, 120, 150, 200)
    unread = [note for note in loaded.notes if "left out" in note]
    assert all(note.startswith("rpic_damping") for note in unread)
