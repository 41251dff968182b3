from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.boundaries import Damping
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN, lame
from jaxphys.mpm.state import Config, Model, initial_state
from jaxphys.mpm.stepping.bounds import (
    contact_bound,
    hard_limit,
    isolated_bound,
    largest_stable_dt,
    moduli,
    moduli_of,
    present_bounds,
    principal_stretches,
    step_bounds,
    validate_dt,
)
from jaxphys.mpm.transfer import AFLIP, APIC, FLIP, PIC, Transfer

LAWS = [NEO_HOOKEAN, FIXED_COROTATED, HENCKY]
DT = 1e-3
VALUES = {"youngs_modulus": jnp.asarray(1e5), "poisson_ratio": jnp.asarray(0.3)}
MU, LAM = (float(x) for x in lame(VALUES))
DENSITY, SPACING = jnp.full(4, 900.0), 0.05


def still(count=4, dtype=jnp.float64):
    return jnp.broadcast_to(jnp.eye(3, dtype=dtype)[:, :, None], (3, 3, count))


def scene(velocity=0.0, affine=0.0, modulus=1e5, gravity=None, boundaries=()):
    """Four particles at (0.5, 0.5, 0.5) m in a domain of 1 x 1 x 2 m."""
    config = Config(Grid((21, 21, 41), SPACING), ((NEO_HOOKEAN, 0, 2), (HENCKY, 2, 4)))
    model = Model(
        mass=DENSITY * 1e-3,
        volume=jnp.full(4, 1e-3),
        parameters={"youngs_modulus": jnp.full(4, modulus), "poisson_ratio": jnp.full(4, 0.3)},
        gravity=gravity,
        boundaries=boundaries,
    )
    state = initial_state(config, jnp.full((4, 3), 0.5))
    state = state._replace(
        velocity=state.velocity.at[1, 2].set(velocity), affine=state.affine.at[0, 1, 1].set(affine)
    )
    return config, model, state


def sound(law, F):
    return float(jnp.min(present_bounds(law, VALUES, F, DENSITY, SPACING)[0]))


def isolated(law, F, C=0.0):
    bounds = isolated_bound(law, VALUES, F, jnp.full((3, 3, 4), C), DENSITY, SPACING)
    return float(jnp.min(bounds))


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_moduli_at_rest(law):
    wave, lone = moduli(law, VALUES, jnp.ones((3, 4)))
    np.testing.assert_allclose(wave, LAM + 2 * MU, rtol=1e-6)
    np.testing.assert_allclose(lone, 2 * MU + 3 * LAM, rtol=1e-6)
    c = np.sqrt((LAM + 2 * MU) / 900)
    assert sound(law, still()) == pytest.approx(SPACING / c, rel=1e-6)


E = np.array([-0.4, 0.1, 0.05])


def test_waves_in_a_stretched_body_in_closed_form():
    """Hencky: along i, s_i^2 psi_ii = (2 mu + lambda) - (2 mu e_i + lambda tr e)."""
    tau = 2 * MU * E + LAM * E.sum()
    axial = (2 * MU + LAM) - tau
    pairs = [
        np.exp(E[i] + E[j]) * (tau[i] - tau[j]) / (np.exp(2 * E[i]) - np.exp(2 * E[j]))
        for i, j in ((0, 1), (0, 2), (1, 2))
    ]
    expected = max(*axial, *pairs)
    wave, _ = moduli(HENCKY, VALUES, jnp.exp(jnp.asarray(E))[:, None])
    assert float(wave[0]) == pytest.approx(expected, rel=1e-9)
    assert expected > LAM + 2 * MU


def test_the_speed_of_sound_is_the_one_in_space():
    """A rod of rho0 and energy psi(s) a rest length, stretched by s: waves run at sqrt(psi'' /
    rho0) in rest lengths, at s times that in space, whatever its volume has become.
    """
    s = np.array([1.6, 1.0, 1.0])
    second = MU * (1 + s[0] ** -2) + LAM * (1 - np.log(s[0])) / s[0] ** 2
    assert s[0] ** 2 * second > LAM + 2 * MU
    F = jnp.asarray(np.diag(s))[..., None] * jnp.ones(4)
    expected = SPACING / (s[0] * np.sqrt(second / 900))
    assert sound(NEO_HOOKEAN, F) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_lone_modulus_is_the_largest_eigenvalue_of_the_stress_derivative(law):
    """By differences of the law's own stress over the nine further strains."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    F = jnp.asarray(turn @ np.diag(np.exp(E)))[..., None]
    h = 1e-5
    columns = []
    for i in range(3):
        for j in range(i, 3):
            # Six symmetric strains, orthonormal.
            e = np.zeros((3, 3))
            e[i, j] = e[j, i] = 1 if i == j else np.sqrt(0.5)
            tau = []
            for side in (-1, 1):
                moved = jnp.einsum("ij,jkp->ikp", np.eye(3) + side * h * e, F)
                tau.append(np.asarray(law.update(VALUES, moved, jnp.zeros((0, 1)), DT)[1][..., 0]))
            columns.append(((tau[1] - tau[0]) / (2 * h), e))
    matrix = [[np.sum(a * e) for _, e in columns] for a, _ in columns]
    expected = np.linalg.eigvals(np.array(matrix)).real.max()
    _, lone = moduli(law, VALUES, jnp.exp(jnp.asarray(E))[:, None])
    assert float(lone[0]) == pytest.approx(expected, rel=1e-6)


def test_an_isolated_particle_is_the_stricter_case():
    assert isolated(HENCKY, still()) == pytest.approx(
        SPACING * np.sqrt(900 / (2 * MU + 3 * LAM)), rel=1e-12
    )
    assert isolated(HENCKY, still()) < sound(HENCKY, still())


def test_strain_and_its_rate_shorten_the_isolated_bound():
    # At a strain of 0.05 a Hencky particle keeps its modulus; the share is sqrt(1/3).
    strained = isolated(HENCKY, jnp.exp(-0.05) * still())
    assert strained == pytest.approx(isolated(HENCKY, still()) / np.sqrt(3), rel=1e-6)
    # Fixed corotated stiffens as it swings back from 0.8 to beyond: the rebound decides.
    J, s = 1.25**3, 1.25
    modulus = 2 * MU * (2 * s**2 - s) + 3 * LAM * (2 * J**2 - J)
    squeezed = isolated(FIXED_COROTATED, 0.8 * still())
    assert squeezed == pytest.approx(SPACING * np.sqrt(900 / (3 * modulus)), rel=1e-6)
    assert squeezed < 0.6 * strained
    # From far off the energy decides: all of it as rate, a fifth a step.
    energy = 0.5 * (2 * MU + 3 * LAM) * 3 * 0.3**2
    rate = np.sqrt(8 * energy / (900 * SPACING**2))
    assert isolated(HENCKY, jnp.exp(0.3) * still()) == pytest.approx(0.2 / rate, rel=1e-6)
    # A rotation alone is no strain.
    spin = jnp.zeros((3, 3, 4)).at[0, 1].set(50.0).at[1, 0].set(-50.0)
    assert isolated(HENCKY, still(), spin) == pytest.approx(isolated(HENCKY, still()))
    assert isolated(HENCKY, still(), jnp.abs(spin)) < 0.9 * isolated(HENCKY, still())


@pytest.mark.parametrize("scheme", [PIC(), FLIP(), APIC(), AFLIP()], ids=repr)
def test_other_transfers_scale_the_bounds(scheme):
    """With k for 4 all lengths are as those of a grid of 2 / sqrt(k) dx, and without an affine part
    the rest is a share of the limit that is 1 / sqrt(2) of it.
    """
    random = np.random.default_rng(3)
    F = still() + 0.1 * jnp.asarray(random.normal(size=(3, 3, 4)))
    C = jnp.asarray(30 * random.normal(size=(3, 3, 4)))
    share = 1 if scheme.affine else np.sqrt(0.5)
    for kernel, k in (("quadratic", 4), ("cubic", 3)):
        found = isolated_bound(
            NEO_HOOKEAN, VALUES, F, C, DENSITY, SPACING, Transfer(scheme, kernel)
        )
        like = isolated_bound(NEO_HOOKEAN, VALUES, F, C, DENSITY, 2 / np.sqrt(k) * SPACING)
        np.testing.assert_allclose(found, share * like, rtol=1e-6)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Spring:
    """A boundary that says how stiff its contact is, [1/s^2] a metre of spacing."""

    rate: float = 1e11

    def stiffest(self, model, grid):
        return jnp.max(model.volume / model.mass) * self.rate * grid.spacing

    def fastest(self):
        return jnp.zeros(())


def test_contact_bounds_the_step_where_a_boundary_says_so():
    assert np.isinf(largest_stable_dt(*scene()).contact)
    bounds = largest_stable_dt(*scene(boundaries=(Damping(1.0), Spring(), Spring(1e10))))
    assert bounds.reason == "contact"
    assert bounds.contact == pytest.approx(2 / np.sqrt(1.1e11 * SPACING / 900), rel=1e-6)
    _, model, _ = scene(boundaries=(Spring(1.1e11),))
    assert float(contact_bound(model, scene()[0].grid)) == pytest.approx(bounds.contact)


def test_advection_knows_the_fall_that_is_coming():
    # From the middle of a domain 1 x 1 x 2 m down to z = 0, with 3 m/s to start with.
    still_there = largest_stable_dt(*scene(velocity=3.0))
    falling = largest_stable_dt(*scene(velocity=3.0, gravity=jnp.array([0.0, 0.0, -9.8])))
    assert still_there.advection == pytest.approx(0.5 * SPACING / 3)
    speed = np.sqrt(9 + 2 * 9.8 * 0.5)
    assert falling.advection == pytest.approx(0.5 * SPACING / speed, rel=1e-6)
    # Up and sideways: to the corner (1, ., 2).
    slanted = largest_stable_dt(*scene(gravity=jnp.array([2.0, 0.0, 4.0])))
    speed = np.sqrt(2 * (2 * 0.5 + 4 * 1.5))
    assert slanted.advection == pytest.approx(0.5 * SPACING / speed, rel=1e-6)


def test_hard_limit_is_that_of_each_particle():
    config, model, state = scene()
    moduli = {"youngs_modulus": jnp.array([1e5, 1e5, 4e5, 1e5])}
    model = replace(model, parameters=model.parameters | moduli)
    (law, _, _) = config.segments[0]
    density = model.mass / model.volume
    limits = hard_limit(law, model.parameters, state.deformation, density, SPACING)
    rest = SPACING * np.sqrt(900 / (2 * MU + 3 * LAM))
    np.testing.assert_allclose(limits, rest * np.array([1, 1, 0.5, 1]), rtol=1e-6)


def test_bounds_can_be_traced_and_differentiated():
    config, model, state = scene()
    # Where two are equally stiff, or all directions alike, there is no derivative.
    strained = jnp.diag(jnp.array([1.03, 1.01, 0.98]))[..., None] * jnp.ones(4)
    state = state._replace(deformation=strained)

    def bound(modulus):
        moduli = {"youngs_modulus": modulus * jnp.array([1.0, 1.1, 1.5, 1.2])}
        changed = replace(model, parameters=model.parameters | moduli)
        return step_bounds(config, changed, state).sound

    slope = jax.jit(jax.grad(bound))(1e5)
    assert float(slope) == pytest.approx(-0.5 * float(bound(1e5)) / 1e5, rel=1e-6)


def test_what_has_no_mass_sets_no_bound():
    config, model, state = scene()
    expected = largest_stable_dt(config, model, state)
    empty = replace(model, mass=model.mass.at[1].set(0), volume=model.volume.at[1].set(0))
    assert largest_stable_dt(config, empty, state) == expected


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


# What is longer than wide, and what is stiffer than float32 squares.


def test_stretches_of_needles_and_discs_in_float32():
    random = np.random.default_rng(0)
    turns = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(40)]
    shapes = ((20.0, 0.22, 0.22), (20.0, 20.0, 0.05), (20.0, 1.0, 0.05), (1.0, 1.0, 0.05))
    for shape in shapes:
        F = np.stack([Q @ np.diag(shape) @ P for Q, P in zip(turns, turns[::-1], strict=True)])
        found = principal_stretches(jnp.asarray(np.moveaxis(F, 0, -1), jnp.float32))
        expected = np.sort(np.linalg.svd(F, compute_uv=False), axis=1)
        np.testing.assert_allclose(np.sort(np.asarray(found), axis=0).T, expected, rtol=0.05)


def test_stretches_near_rest_keep_their_digits():
    F = np.eye(3)[..., None] + 1e-4 * np.random.default_rng(1).normal(size=(3, 3, 50))
    found = principal_stretches(jnp.asarray(F, jnp.float32))
    expected = np.linalg.svd(np.moveaxis(F, -1, 0), compute_uv=False)
    strains = np.sort(np.asarray(found, np.float64), axis=0).T - 1
    np.testing.assert_allclose(strains, np.sort(expected, axis=1) - 1, atol=4e-7)


def test_the_stiffest_has_a_bound_in_float32():
    """lambda J^2 of steel at 20 times its size is 1e18 Pa, whose square float32 cannot hold."""
    F = jnp.asarray(20 * np.eye(3)[..., None], jnp.float32)
    steel = {"youngs_modulus": jnp.float32(1e12), "poisson_ratio": jnp.float32(0.3)}
    narrow = moduli_of(FIXED_COROTATED, steel, F)[1]
    wide = moduli_of(FIXED_COROTATED, jax.tree.map(np.float64, steel), F.astype(jnp.float64))[1]
    assert float(wide[0]) > 2e19
    np.testing.assert_allclose(narrow, wide, rtol=1e-3)
