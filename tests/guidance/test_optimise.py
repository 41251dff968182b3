from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import from_points, scales
from jaxphys.guidance.bundled.pixel_guide import PixelGuide
from jaxphys.guidance.bundled.pixel_prior import PixelPrior, PixelPriorConfig
from jaxphys.guidance.bundled.point_guide import PointGuide
from jaxphys.guidance.bundled.point_prior import PointPrior, PointPriorConfig
from jaxphys.guidance.guides import Guides
from jaxphys.guidance.optimise import OptimiseConfig, draw_views, optimise, start, text_to_gaussians
from jaxphys.guidance.pictures import neighbour_sizes, view_picture
from jaxphys.guidance.stages import RATES, Stage, two
from jaxphys.guidance.views import ELEVATIONS

CONFIG = OptimiseConfig(count=24, room=1.5, steps=4, views=2, density_every=2)
# Two steps of geometry, six of appearance; rounds of density control before steps 2, 4 and 6.
TWO = replace(CONFIG, steps=8, room=3.0, stages=two(0.25))


@pytest.fixture(scope="module")
def guides():
    pixel = PixelPriorConfig(
        patch=16, text=12, width=32, layers=1, head_width=16, hidden=32, rank=4
    )
    point = PointPriorConfig(
        text=12,
        width=32,
        latents=8,
        latent_width=32,
        blocks=1,
        latent_layers=1,
        head_width=16,
        hidden=32,
        latent_hidden=32,
        rank=4,
    )
    text = jnp.ones((1, 12), jnp.float32) / 12**0.5
    return Guides(
        PixelGuide(PixelPrior(pixel, rngs=nnx.Rngs(0)), text),
        PointGuide(PointPrior(point, rngs=nnx.Rngs(0)), text),
    )


def cloud():
    rng = np.random.default_rng(0)
    points = jnp.asarray(rng.uniform(-0.4, 0.4, (24, 3)), jnp.float32)
    return from_points(points, jnp.asarray(rng.uniform(size=(24, 3)), jnp.float32), 0.03)


def test_resumed_run_ends_in_the_same_bytes(guides):
    key, states = jax.random.key(0), []
    through = optimise(guides, start(cloud(), CONFIG), key, CONFIG, on_step=states.append)
    assert [int(s.step) for s in states] == [1, 2, 3, 4]
    resumed = optimise(guides, states[1], key, CONFIG)
    for a, b in zip(jax.tree.leaves(through), jax.tree.leaves(resumed), strict=True):
        np.testing.assert_array_equal(a, b)
    before, after = start(cloud(), CONFIG).gaussians, through.gaussians
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(after))
    assert np.abs(after.means - before.means).max() > 1e-4
    assert after.means.dtype == jnp.float32
    assert after.count == 36 and int(through.alive.sum()) >= 24


@pytest.fixture(scope="module")
def in_two_stages(guides):
    """Every state of a run, its end, and its key; states[k] is the one after k + 1 steps."""
    key, states = jax.random.key(0), []
    end = optimise(guides, start(cloud(), TWO), key, TWO, on_step=states.append)
    return states, end, key


@pytest.mark.parametrize("after", [1, 2, 5])
@pytest.mark.slow
def test_two_stages_resume_to_the_same_bytes(guides, in_two_stages, after):
    """Interrupted within geometry, at its end and within appearance."""
    states, end, key = in_two_stages
    resumed = optimise(guides, states[after - 1], key, TWO)
    for a, b in zip(jax.tree.leaves(end), jax.tree.leaves(resumed), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.slow
def test_stages_ask_what_they_say(guides, in_two_stages):
    """How much the 3D prior counts decides geometry and leaves appearance alone."""
    states, end, key = in_two_stages
    louder = replace(TWO, shape_weight=50.0)
    optimise(guides, start(cloud(), louder), key, louder, on_step=(kept := []).append)
    assert np.abs(kept[0].gaussians.means - states[0].gaussians.means).max() > 0
    later = optimise(guides, states[1], key, louder)
    for a, b in zip(jax.tree.leaves(end), jax.tree.leaves(later), strict=True):
        np.testing.assert_array_equal(a, b)
    # Geometry keeps the Gaussians; the first round of appearance closes gaps.
    assert int(states[0].alive.sum()) == 24 and int(states[1].alive.sum()) > 24


def test_a_rate_of_zero_keeps_a_field(guides):
    frozen = tuple((name, 0.0 if name == "means" else rate) for name, rate in RATES)
    stages = (Stage(0.5, density="none"), Stage(0.5, shape=False, density="none", rates=frozen))
    config = replace(CONFIG, stages=stages)
    begun = start(cloud(), config)
    optimise(guides, begun, jax.random.key(0), config, on_step=(states := []).append)
    means = [state.gaussians.means for state in states]
    assert np.abs(means[0] - begun.gaussians.means).max() > 1e-4
    assert np.abs(means[1] - means[0]).max() > 1e-4
    np.testing.assert_array_equal(means[3], means[1])
    moved = states[3].gaussians.log_scales - states[1].gaussians.log_scales
    assert np.abs(moved).max() > 1e-4


@pytest.mark.slow
def test_interval_score_matching_reaches_the_gaussians(guides):
    usual, key = replace(CONFIG, steps=1), jax.random.key(0)
    config = replace(usual, image=replace(CONFIG.image, method="ism", inversion=2))
    found, usual = (optimise(guides, start(cloud(), c), key, c) for c in (config, usual))
    means = found.gaussians.means
    assert np.isfinite(means).all() and np.abs(means - usual.gaussians.means).max() > 0


def test_without_distillation_the_surface_is_the_result(guides):
    class Drawn(NamedTuple):
        """Draws a noisy ball."""

        def sample(self, key, count):
            normals = jax.random.normal(key, (count, 3))
            normals /= jnp.linalg.norm(normals, axis=1, keepdims=True)
            return 0.4 * normals, jnp.full((count, 3), 0.7)

    config = OptimiseConfig(steps=0, cloud=1200, surface=900)
    found = text_to_gaussians("a ball", config=config, guides=guides._replace(shape=Drawn()))
    radius = np.linalg.norm(found.means, axis=1)
    assert found.count == 900 and np.abs(radius - 0.4).max() < 0.01
    size = np.asarray(scales(found))
    assert (size[:, 2] < 0.2 * size[:, 0]).all()


def test_front_is_seen_from_azimuth_zero():
    """A red dot at the front (+x), a green one at +y, a blue one above."""
    dots = from_points(jnp.eye(3, dtype=jnp.float32) * 0.4, jnp.eye(3), 0.02, opacity=0.99)
    zero, black = jnp.float32(0), jnp.zeros(3)
    front = np.asarray(view_picture(dots, zero, zero, black, None).colour)
    row, column = np.unravel_index(front[..., 1].argmax(), (64, 64))
    assert abs(row - 32) <= 1 and column > 38  # +y is to the right of who looks along -x
    row, column = np.unravel_index(front[..., 2].argmax(), (64, 64))
    assert abs(column - 32) <= 1 and row < 26
    side = np.asarray(view_picture(dots, jnp.float32(np.pi / 2), zero, black, None).colour)
    assert np.unravel_index(side[..., 0].argmax(), (64, 64))[1] < 26


def test_views_cover_the_trained_band():
    azimuth, elevation = draw_views(jax.random.key(1), 400)
    assert np.ptp(azimuth % (2 * np.pi)) > 6.2
    assert ELEVATIONS[0] <= elevation.min() and elevation.max() <= ELEVATIONS[1]
    np.testing.assert_allclose(np.sin(elevation).mean(), np.sin(ELEVATIONS).mean(), atol=0.05)


def test_neighbour_sizes():
    line = np.stack([np.arange(6) * 0.02, np.zeros(6), np.zeros(6)], 1)
    np.testing.assert_allclose(neighbour_sizes(line, 0.5, 1.0)[2:4], 0.5 * 0.08 / 3, rtol=1e-5)
    np.testing.assert_allclose(neighbour_sizes(line[:1], 0.5, 0.04), 0.02)
    np.testing.assert_allclose(neighbour_sizes(np.zeros((5, 3)), 0.5, 0.04), 1e-3)


def test_empty_requests_are_refused():
    with pytest.raises(InputError, match="empty"):
        text_to_gaussians("  ")
    with pytest.raises(InputError, match="at least one"):
        text_to_gaussians("a can", config=OptimiseConfig(count=0))
