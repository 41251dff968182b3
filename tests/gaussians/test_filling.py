import dataclasses
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from jaxphys.core.errors import InputError
from jaxphys.gaussians.filling import FillingConfig, fill, fill_interior, inner_cells
from jaxphys.gaussians.gaussians import Gaussians, from_points
from jaxphys.gaussians.relax import blue_noise
from jaxphys.gaussians.surface import facing

CONFIG = FillingConfig(spacing=0.1, density_threshold=0.5)


def shell(count=2500, opening=2.0, size=0.05):
    """Discs on the unit sphere, up to height `opening`."""
    index = np.arange(count) + 0.5
    z, turn = 1 - 2 * index / count, np.pi * (1 + np.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    d = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=-1)[z < opening]
    sizes = np.broadcast_to([size, size, 0.1 * size], d.shape)
    return Gaussians(
        jnp.asarray(d),
        jnp.log(jnp.asarray(sizes)),
        jnp.asarray(facing(d)),
        jnp.full(len(d), 3.0),
        jnp.zeros((len(d), 1, 3)),
    )


@pytest.mark.parametrize("ray", [-1, 0, 1, 4, 5])
def test_a_hollow_ball_is_filled(ray):
    points = fill_interior(shell(), dataclasses.replace(CONFIG, ray_direction=ray), seed=1)
    radius = np.linalg.norm(points, axis=1)
    assert radius.max() < 1.0
    inner = np.sum(radius < 0.8)
    np.testing.assert_allclose(inner, 4 / 3 * np.pi * 0.8**3 / 0.1**3, rtol=0.05)
    again = fill_interior(shell(), dataclasses.replace(CONFIG, ray_direction=ray), seed=1)
    np.testing.assert_array_equal(points, again)
    cells = np.unique(np.floor(points / 0.1 + 1e-9), axis=0)
    assert len(cells) > 0.5 * len(points)


def test_an_open_bowl_is_filled_only_when_told():
    bowl = shell(opening=0.5)

    def inside(**options):
        points = fill_interior(bowl, dataclasses.replace(CONFIG, **options))
        return int(np.sum(np.linalg.norm(points, axis=1) < 0.5))

    assert inside() == 0
    # Without looking up, the bowl closes; an odd number of runs downwards agrees.
    expected = 4 / 3 * np.pi * 0.5**3 / 0.1**3
    np.testing.assert_allclose(inside(exclude_direction=4), expected, rtol=0.1)
    np.testing.assert_allclose(inside(search_count=5), expected, rtol=0.1)
    np.testing.assert_allclose(inside(search_count=5, ray_direction=5), expected, rtol=0.1)
    assert inside(search_count=5, ray_direction=4) == 0


def test_rules_on_a_grid_by_hand():
    # A ring in the xy plane around an empty cell, and a second empty cell outside of it.
    density = np.zeros((5, 4, 1))
    density[0:3, 0:3, 0] = 1
    density[1, 1, 0] = 0
    density[4, 1, 0] = 0
    config = FillingConfig(1.0, density_threshold=0.5, search_count=4)
    assert np.argwhere(inner_cells(density, config)).tolist() == [[1, 1, 0]]
    strict = dataclasses.replace(config, search_count=5)
    assert not inner_cells(density, strict).any()
    # Two runs lie towards +x of (1, 1) once there is a wall at x = 4.
    density[4, 1, 0] = 1
    assert not inner_cells(density, dataclasses.replace(config, ray_direction=0)).any()
    assert inner_cells(density, dataclasses.replace(config, ray_direction=1)).any()
    higher = dataclasses.replace(config, search_threshold=1.5)
    assert not inner_cells(density, higher).any()


def test_counts_area_and_limits():
    one = fill_interior(shell(), CONFIG)
    three = fill_interior(shell(), dataclasses.replace(CONFIG, per_cell=3))
    inner = [np.sum(np.linalg.norm(p, axis=1) < 0.7) for p in (one, three)]
    np.testing.assert_allclose(inner[1], 3 * inner[0], rtol=0.05)
    upper = dataclasses.replace(CONFIG, area=(-2, 2, -2, 2, 0, 2))
    # The lower half is cut off, and the upper then has nothing below it.
    assert np.all(fill_interior(shell(), upper)[:, 2] > 0)
    open_below = dataclasses.replace(upper, exclude_direction=5)
    assert np.sum(np.linalg.norm(fill_interior(shell(), open_below), axis=1) < 0.7) > 500
    with pytest.raises(InputError, match="more than the maximum of 100"):
        fill_interior(shell(), dataclasses.replace(CONFIG, maximum=100))
    with pytest.raises(InputError, match="make it coarser"):
        fill_interior(shell(), dataclasses.replace(CONFIG, spacing=1e-4))
    with pytest.raises(InputError, match="must be positive"):
        fill_interior(shell(), dataclasses.replace(CONFIG, spacing=0.0))
    with pytest.raises(InputError, match="holds no Gaussians"):
        fill_interior(shell(), dataclasses.replace(CONFIG, area=(5, 6, 5, 6, 5, 6)))


def test_enormous_degenerate_and_invalid_gaussians():
    g = shell()
    huge = dataclasses.replace(g, log_scales=g.log_scales.at[0].set(1e4).at[1].set(-1e4))
    huge = dataclasses.replace(huge, quaternions=huge.quaternions.at[2].set(0))
    points = fill_interior(huge, CONFIG)
    assert np.isfinite(points).all() and np.linalg.norm(points, axis=1).max() < 2.2
    nan = dataclasses.replace(g, log_scales=g.log_scales.at[3].set(jnp.nan))
    with pytest.raises(InputError, match="filling: log_scales not finite"):
        fill_interior(nan, CONFIG)
    none = Gaussians(*(jnp.zeros((0, *s)) for s in [(3,), (3,), (4,), (), (1, 3)]))
    assert fill_interior(none, CONFIG).shape == (0, 3)


def nearest(points):
    return cKDTree(points).query(points, k=2)[0][:, 1]


def test_relaxed_points_are_blue_noise():
    random = np.random.default_rng(0)
    points = random.uniform(0, 2.0, (700, 3))
    diameter = 2.0 / 700 ** (1 / 3)
    relaxed = blue_noise(points, diameter)
    before, after = nearest(points) / diameter, nearest(relaxed) / diameter
    assert before.std() / before.mean() > 0.3  # Poisson: 0.36
    assert after.std() / after.mean() < 0.1
    assert np.quantile(after, 0.05) > 0.75 > np.quantile(before, 0.5)
    assert np.abs(relaxed - points).max() <= 0.75 * diameter * (1 + 1e-5)
    np.testing.assert_array_equal(relaxed, blue_noise(points, diameter))


def test_neighbour_lists_that_are_too_short_are_made_longer(monkeypatch):
    points = np.random.default_rng(0).uniform(0, 4.0, (64, 3))
    monkeypatch.setattr("jaxphys.gaussians.relax._CAPACITY", 0.3)
    # Spheres whose neighbour was dropped from the list would still overlap.
    relaxed = blue_noise(points, 1.0)
    assert nearest(relaxed).min() > 0.7 > np.quantile(nearest(points), 0.6)


def test_fixed_points_push_but_do_not_move():
    fixed = np.array([[0.0, 0.0, 0.0]])
    relaxed = blue_noise(np.array([[0.1, 0.0, 0.0]], np.float32), 1.0, fixed=fixed)
    assert relaxed.dtype == np.float32
    np.testing.assert_allclose(relaxed[0, 1:], 0, atol=1e-5)
    assert 0.8 < relaxed[0, 0] <= 0.86  # as far as a point may go


def test_nothing_to_relax():
    np.testing.assert_array_equal(blue_noise(np.ones((1, 3)), 0.1), np.ones((1, 3)))
    assert blue_noise(np.zeros((0, 3)), 0.1).shape == (0, 3)
    with pytest.raises(InputError, match="must be positive"):
        blue_noise(np.zeros((3, 3)), 0.0)
    with pytest.raises(InputError, match="not finite"):
        blue_noise(np.full((3, 3), np.nan), 0.1)


def test_relaxing_without_jax_md_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "jax_md", None)
    with pytest.raises(InputError, match=r"pip install 'jaxphys-splats\[relax\]'"):
        blue_noise(np.eye(3), 0.1)


@pytest.mark.parametrize("count", [900, 6000])
def test_sparse_and_dense_shells_are_filled_by_the_same_default(count):
    turn = np.arange(count) * np.pi * (3 - 5**0.5)
    z = 1 - (2 * np.arange(count) + 1) / count
    level = np.sqrt(1 - z**2)
    ball = np.stack([level * np.cos(turn), level * np.sin(turn), z], 1).astype(np.float32)
    # As wide as closes the shell: deviations of 0.6 times the distance between neighbours.
    shell = from_points(ball, np.ones(3), 0.6 * (4 * np.pi / count) ** 0.5, opacity=0.9)
    spacing = 0.1
    added = fill_interior(shell, FillingConfig(spacing))
    cells = 4 / 3 * np.pi / spacing**3
    assert 0.95 * cells < len(added) + count < 1.6 * cells + count
    middle = np.linalg.norm(added, axis=1) < 0.7
    assert middle.sum() > 0.9 * cells * 0.7**3
    # Negative control: a threshold that suits the dense shell leaves the sparse one hollow.
    fixed = fill_interior(shell, FillingConfig(spacing, density_threshold=2.0))
    hollow = np.linalg.norm(fixed, axis=1) < 0.7
    assert (hollow.sum() < 0.5 * middle.sum()) == (count == 900)


@pytest.mark.parametrize("width", [0.0, 1e-4])
def test_what_is_smaller_than_a_cell_is_no_skin(width):
    """Splats at one place, or nearly, are filled by nothing and weigh as one particle does."""
    points = width * np.random.default_rng(0).random((50, 3)) + 0.3
    filled = fill(from_points(points, np.full(3, 0.5), 0.1), CONFIG)
    assert len(filled.points) == 0
    assert filled.volumes.sum() <= 0.1**3 * (1 + 1e-9) and filled.volumes.min() > 0
