from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN, lame
from jaxphys.mpm.time_step import (
    isolated_bound,
    largest_stable_dt,
    sound_bound,
    stiffness,
    validate_dt,
)

LAWS = [NEO_HOOKEAN, FIXED_COROTATED, HENCKY]
VALUES = {"youngs_modulus": jnp.asarray(1e5), "poisson_ratio": jnp.asarray(0.3)}
MU, LAM = (float(x) for x in lame(VALUES))
DENSITY, SPACING = jnp.full(4, 900.0), 0.05


def still(count=4, dtype=jnp.float64):
    return jnp.broadcast_to(jnp.eye(3, dtype=dtype)[:, :, None], (3, 3, count))


def scene(velocity=0.0, affine=0.0, modulus=1e5, F=None):
    config = SimpleNamespace(
        grid=SimpleNamespace(spacing=SPACING), segments=((NEO_HOOKEAN, 0, 2), (HENCKY, 2, 4))
    )
    model = SimpleNamespace(
        mass=DENSITY * 1e-3,
        volume=jnp.full(4, 1e-3),
        parameters={"youngs_modulus": jnp.full(4, modulus), "poisson_ratio": jnp.full(4, 0.3)},
    )
    state = SimpleNamespace(
        velocity=jnp.zeros((3, 4)).at[1, 2].set(velocity),
        affine=jnp.zeros((3, 3, 4)).at[0, 1, 1].set(affine),
        deformation=still() if F is None else F,
    )
    return config, model, state


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_at_rest_the_stiffness_is_the_p_wave_modulus(law):
    np.testing.assert_allclose(stiffness(law, VALUES, still()), LAM + 2 * MU, rtol=1e-6)
    c = np.sqrt((LAM + 2 * MU) / 900)
    bound = sound_bound(law, VALUES, still(), DENSITY, SPACING)
    assert float(bound) == pytest.approx(SPACING / c, rel=1e-6)


def test_stiffness_of_a_stretch_in_closed_form():
    """Hencky: along i, s_i^2 psi_ii = (2 mu + lambda) - (2 mu e_i + lambda tr e)."""
    e = np.array([-0.4, 0.1, 0.05])
    F = jnp.asarray(np.diag(np.exp(e))[:, :, None])
    tau = 2 * MU * e + LAM * e.sum()
    axial = (2 * MU + LAM) - tau
    pairs = [
        np.exp(e[i] + e[j]) * (tau[i] - tau[j]) / (np.exp(2 * e[i]) - np.exp(2 * e[j]))
        for i, j in ((0, 1), (0, 2), (1, 2))
    ]
    expected = max(*axial, *pairs)
    assert float(stiffness(HENCKY, VALUES, F)[0]) == pytest.approx(expected, rel=1e-9)
    assert expected > LAM + 2 * MU


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_compression_shortens_the_step(law):
    squeezed = still() * 0.6
    assert float(sound_bound(law, VALUES, squeezed, DENSITY, SPACING)) < float(
        sound_bound(law, VALUES, still(), DENSITY, SPACING)
    )


def test_an_isolated_particle_is_the_stricter_case():
    isolated = float(isolated_bound(VALUES, DENSITY, SPACING))
    assert isolated == pytest.approx(SPACING * np.sqrt(900 / (2 * MU + 3 * LAM)), rel=1e-12)
    assert isolated < float(sound_bound(HENCKY, VALUES, still(), DENSITY, SPACING))


@pytest.mark.parametrize(
    ("motion", "reason", "expected"),
    [
        ({}, "isolated", SPACING * np.sqrt(900 / (2 * MU + 3 * LAM))),
        ({"velocity": 500.0}, "advection", 0.5 * SPACING / 500),
        ({"affine": 1e4}, "gradient", 0.2 / 1e4),
    ],
)
def test_the_tightest_bound_decides(motion, reason, expected):
    bounds = largest_stable_dt(*scene(**motion), safety=0.5)
    assert bounds.reason == reason
    assert getattr(bounds, reason) == pytest.approx(expected, rel=1e-6)
    assert bounds.dt == pytest.approx(0.5 * expected, rel=1e-6)
    assert all(
        b >= getattr(bounds, reason)
        for b in (bounds.sound, bounds.isolated, bounds.advection, bounds.gradient)
    )


def test_the_step_scales_as_the_square_root_of_stiffness():
    soft, stiff = (largest_stable_dt(*scene(modulus=m)).dt for m in (1e5, 4e5))
    assert soft == pytest.approx(2 * stiff, rel=1e-6)


def test_a_step_over_the_bound_is_refused_with_the_largest_safe_one():
    bounds = largest_stable_dt(*scene())
    validate_dt(bounds.dt, bounds)
    validate_dt(bounds.isolated, bounds)
    with pytest.raises(InputError, match=f"isolated.*largest safe one is {bounds.dt:.3g} s"):
        validate_dt(1.01 * bounds.isolated, bounds)
    validate_dt(1.01 * bounds.isolated, bounds, unsafe=True)
    for wrong in (0.0, -1e-4, float("nan"), float("inf")):
        with pytest.raises(InputError, match="positive and finite"):
            validate_dt(wrong, bounds, unsafe=True)


def test_a_state_that_is_not_finite_gives_no_bound():
    with pytest.raises(InputError, match="not finite"):
        largest_stable_dt(*scene(velocity=float("nan")))
