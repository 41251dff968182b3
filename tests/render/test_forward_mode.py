"""The tangent of blending: against the dense reference, central differences and its transpose."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.render import Settings
from jaxphys.render.binning import make_grid, tile_boxes, tile_lists
from jaxphys.render.blending import _forward, blend, blend_tangent
from jaxphys.render.blending_gradient import blend_backward
from jaxphys.render.projection import project

from .scenes import random_splats, test_camera

WIDTH, HEIGHT, CAPACITY = 40, 31, 2048


def blended(settings, count=40, seed=3):
    """Arguments of `blend` for some splats, opaque ones that reach the clamp among them."""
    splats = random_splats(count, seed, size=0.15, opacity=(0.3, 1.0))
    splats = splats._replace(opacities=splats.opacities.at[::5].set(1.0))
    grid = make_grid(WIDTH, HEIGHT, settings)
    projected = project(splats, test_camera(WIDTH, HEIGHT), settings)
    boxes = tile_boxes(projected, grid, settings)
    assert int(boxes.required) <= CAPACITY
    lists = tile_lists(projected, boxes, grid, settings, CAPACITY)
    geometry = jnp.concatenate([projected.centres, projected.factors, projected.opacities[None]])
    return geometry, splats.colours.T, boxes, lists, grid


def directions(geometry, features, seed=0):
    rng = np.random.default_rng(seed)
    # Centres move by pixels, factors and opacities by less than they are.
    scale = np.array([1.0, 1.0, 0.1, 0.1, 0.1, 0.1])[:, None]
    return (
        jnp.asarray(scale * rng.normal(size=geometry.shape)),
        jnp.asarray(rng.normal(size=features.shape)),
    )


CASES = {
    # Everything at once, but for the skip: its jump of 1/255 is no derivative.
    "default": Settings(alpha_min=1e-9),
    "small groups": Settings(alpha_min=1e-9, tile_size=16, chunk_size=3, group_size=2),
    "through clamp": Settings(alpha_min=1e-9, gradient_through_clamp=True),
}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    settings = CASES[request.param]
    geometry, features, boxes, lists, grid = blended(settings)
    tangents = directions(geometry, features)
    total, residuals = jax.jit(_forward, static_argnums=(4, 5))(
        geometry, features, boxes, lists, grid, settings
    )
    slope = jax.jit(blend_tangent, static_argnums=(0, 1))(grid, settings, residuals, tangents)
    return (
        request.param,
        settings,
        (geometry, features, boxes, lists, grid),
        tangents,
        (
            total,
            residuals,
            slope,
        ),
    )


def test_central_differences(case):
    name, settings, (geometry, features, boxes, lists, grid), tangents, (_, _, slope) = case
    if name == "through clamp":
        pytest.skip("what passes through the clamp is by definition not the derivative")

    @jax.jit
    def moved(step):
        along = jax.tree.map(lambda x, d: x + step * d, (geometry, features), tangents)
        return blend(*along, boxes, lists, grid, settings)

    step = 1e-6
    differences = (moved(step) - moved(-step)) / (2 * step)
    # Where a pixel's clamp or stop lies within the step, there is no derivative to compare with.
    far = np.abs(differences - slope) > 1e-5 * (1 + np.abs(slope))
    assert far.mean() < 2e-3
    assert float(jnp.linalg.norm(slope)) > 10


def test_gradient_is_the_transpose(case):
    _, settings, (_, _, _, _, grid), tangents, (total, residuals, slope) = case
    weights = jnp.asarray(np.random.default_rng(1).normal(size=total.shape))
    back = jax.jit(blend_backward, static_argnums=(0, 1))(grid, settings, residuals, weights)
    forth = jnp.sum(slope * weights)
    again = sum(jnp.sum(g * d) for g, d in zip(back[:2], tangents, strict=True))
    np.testing.assert_allclose(forth, again, rtol=1e-10)


def test_clamp_matters_to_the_tangent():
    slopes = []
    for through in (False, True):
        settings = Settings(gradient_through_clamp=through)
        geometry, features, boxes, lists, grid = blended(settings)
        residuals = _forward(geometry, features, boxes, lists, grid, settings)[1]
        slopes.append(blend_tangent(grid, settings, residuals, directions(geometry, features)))
    assert float(jnp.max(jnp.abs(slopes[0] - slopes[1]))) > 1e-3


def test_tangents_side_by_side_are_each_of_them():
    settings = Settings()
    geometry, features, boxes, lists, grid = blended(settings)
    residuals = _forward(geometry, features, boxes, lists, grid, settings)[1]
    several = [directions(geometry, features, seed) for seed in range(3)]
    stacked = jax.tree.map(lambda *x: jnp.stack(x), *several)

    def along(tangents):
        return blend_tangent(grid, settings, residuals, tangents)

    together = jax.jit(jax.vmap(along))(stacked)
    for one, tangents in zip(together, several, strict=True):
        np.testing.assert_allclose(one, jax.jit(along)(tangents), atol=1e-12)
