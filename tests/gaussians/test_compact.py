import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.compact import CompactConfig, close_gaps
from jaxphys.gaussians.density import with_capacity
from jaxphys.gaussians.gaussians import Gaussians, from_points, opacities, scales

DENSE = CompactConfig(neighbours=1)


def row(places, sizes, capacity):
    """Gaussians along x, each of its own colour."""
    points = np.stack([places, np.zeros(len(places)), np.zeros(len(places))], 1)
    colours = np.linspace(0.2, 0.8, 3 * len(places)).reshape(-1, 3)
    gaussians = from_points(jnp.asarray(points), jnp.asarray(colours), jnp.asarray(sizes))
    return with_capacity(gaussians, capacity)


def test_a_gap_gets_a_gaussian_of_its_size():
    """Ends at 0.2 and 1 - 0.1, so the gap is 0.7 wide around 0.55."""
    gaussians, alive = row([0.0, 1.0], [0.1, 0.05], 4)
    update = close_gaps(gaussians, alive, DENSE)
    np.testing.assert_array_equal(update.alive, [True, True, True, False])
    np.testing.assert_allclose(update.gaussians.means[2], [0.55, 0, 0], atol=1e-12)
    np.testing.assert_allclose(scales(update.gaussians)[2], 0.7 / 4, rtol=1e-6)
    np.testing.assert_array_equal(update.gaussians.harmonics[2], gaussians.harmonics[0])
    assert opacities(update.gaussians)[2] == opacities(gaussians)[0]
    assert opacities(update.gaussians)[3] < 1e-6
    np.testing.assert_array_equal(update.source, [0, 1, 0, 3])
    np.testing.assert_array_equal(update.fresh, [False, False, True, True])
    for field in ("means", "log_scales", "quaternions", "opacity_logits", "harmonics"):
        before, after = getattr(gaussians, field), getattr(update.gaussians, field)
        np.testing.assert_array_equal(before[:2], after[:2])


def test_what_touches_has_no_gap():
    gaussians, alive = row([0.0, 1.0, 2.0], [0.25, 0.26, 0.25], 9)
    update = close_gaps(gaussians, alive, CompactConfig(neighbours=1))
    assert int(update.alive.sum()) == 3 and int(update.unserved) == 0
    # Held against farther ones too, the outer two have a gap: 2 - 4 * 0.25.
    assert int(close_gaps(gaussians, alive, CompactConfig(neighbours=2)).alive.sum()) == 4


def test_the_direction_counts():
    """Flat across the line: standard deviation 0.01 along it, though 0.5 across."""
    gaussians, alive = row([0.0, 1.0], [0.1, 0.1], 3)
    flat = jnp.log(jnp.array([[0.01, 0.5, 0.5]] * 3))
    thin = Gaussians(
        gaussians.means,
        flat,
        gaussians.quaternions,
        gaussians.opacity_logits,
        gaussians.harmonics,
    )
    found = scales(close_gaps(thin, alive, DENSE).gaussians)[2]
    np.testing.assert_allclose(found, 0.96 / 4, rtol=1e-6)


def test_the_widest_gaps_come_first():
    gaussians, alive = row([0.0, 1.0, 3.0, 3.5], [0.05] * 4, 5)
    update = close_gaps(gaussians, alive, CompactConfig(neighbours=2))
    assert int(update.alive.sum()) == 5
    # Pairs: 0-1, 0-3.0, 1-3.0, 1-3.5, 3.0-3.5; the widest is 0-3.0, gap 2.8.
    np.testing.assert_allclose(update.gaussians.means[4, 0], 1.5, atol=1e-12)
    assert int(update.unserved) == 4


def test_few_or_coincident_gaussians_have_none():
    for places in ([0.3], [0.3, 0.3]):
        gaussians, alive = row(places, [0.05] * len(places), 4)
        assert int(close_gaps(gaussians, alive).alive.sum()) == len(places)
    with pytest.raises(InputError, match="reach"):
        CompactConfig(reach=0.0)
