"""Frames drawn at once against frames drawn by themselves."""

from dataclasses import replace
from itertools import islice

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.ensemble import over_devices
from jaxphys.mpm import Placement
from jaxphys.mpm.loop.frames import rollout_frames
from jaxphys.pipeline.draw import SETTINGS, draw
from jaxphys.pipeline.film import ROOM, Artist, _room, drawn_at_once, picture, settings_for
from jaxphys.pipeline.frames import frames
from jaxphys.pipeline.output import Timing
from jaxphys.render.camera import orbit
from jaxphys.scene.build import build
from tests.pipeline.test_animate import small_scene, sphere


def test_frames_at_once_are_each_of_them():
    scene = small_scene(frames=6)
    simulation, look = build(scene, sphere())
    moving = [moment.frame for moment in islice(frames(simulation), scene.frames)]
    artist = Artist(scene, look, moving, Timing())
    assert artist.at_once == min(scene.frames, jax.device_count()) > 2
    # The second time there are fewer frames than are drawn at once.
    first = artist.at_once
    drawn = artist.paint(0, moving[:first]) + artist.paint(first, moving[first:])
    assert len(drawn) == scene.frames
    for index, pixels in enumerate(drawn):
        alone, _ = picture(
            look,
            moving[index],
            artist.cameras[index],
            artist._middle,
            artist._extent,
            surroundings=artist._surroundings,
            capacity=artist._capacity,
        )
        apart = np.abs(pixels.astype(int) - np.asarray(alone).astype(int))
        # A value that lies between two bytes may be rounded to either.
        assert apart.max() <= 1 and (apart > 0).mean() < 1e-3
    assert np.abs(drawn[0].astype(int) - drawn[-1].astype(int)).max() > 20


def test_no_more_at_once_than_there_are():
    assert drawn_at_once(1) == 1
    assert drawn_at_once(3) == min(3, jax.device_count())
    assert drawn_at_once(1000) == min(8, jax.device_count())


@pytest.mark.parametrize("needed", [0, 1, 223, 1_000, 948_687, 2_985_313])
def test_room_is_an_eighth_more_than_asked_for_at_most(needed):
    assert ROOM * needed - 1 < _room(needed) <= max(256, 1.126 * ROOM * needed)


def test_only_tiles_depend_on_the_size_of_a_picture():
    small, large = (
        settings_for(orbit((0, 0, 0), 1.0, 0.0, 0.0, width=width, height=height))
        for width, height in ((320, 180), (1958, 1090))
    )
    assert small == SETTINGS and large == replace(SETTINGS, tile_size=16)


@pytest.mark.slow
def test_one_program_simulates_and_draws_over_devices():
    """Pixels of several cameras by velocity and stiffness, on two devices and on one."""
    devices = min(2, jax.device_count())
    simulation, look = build(small_scene(), sphere(), dtype="float64")
    cameras = [
        orbit((0.5, 0.5, 0.4), 1.3, turn, 0.3, width=24, height=20, dtype=jnp.float64)
        for turn in (0.1, 1.4, 2.9)
    ]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *cameras)
    rng = np.random.default_rng(0)
    weights = jnp.asarray(rng.normal(size=(3, 20, 24, 3)))

    def program(placement, mapped):
        config = replace(simulation.config, placement=placement)
        base = replace(simulation, config=config)

        @jax.jit
        def of(velocity, modulus):
            moved = base.with_(velocity=velocity, youngs_modulus=modulus)
            frame = rollout_frames(moved, 3)[-1]
            pictures = mapped(lambda camera: draw(look, frame, camera, capacity=2048).colour)
            return jnp.sum(pictures(stacked) * weights)

        return jax.jit(jax.value_and_grad(of, argnums=(0, 1)))

    start = jnp.array([0.3, 0.0, -1.0]), jnp.array(2e3)
    spread = program(Placement(devices, 64), lambda f: over_devices(f, devices, in_turn=True))(
        *start
    )
    alone = program(Placement(), lambda f: lambda x: jax.lax.map(f, x))(*start)
    for one, other in zip(jax.tree.leaves(spread), jax.tree.leaves(alone), strict=True):
        assert np.abs(other).max() > 0
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8 * np.abs(other).max())
