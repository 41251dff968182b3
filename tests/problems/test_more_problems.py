"""Problems whose answer is a number: their references against independent ones, and the solver
against them on coarse grids, each with something wrong that must fail.
"""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.problems.catalogue import PROBLEMS
from jaxphys.problems.channel import Bingham, Poiseuille
from jaxphys.problems.disc import Disc
from jaxphys.problems.discrete import displacement_errors, observed_order, solve
from jaxphys.problems.granular import Grains
from jaxphys.problems.kinematics import body_acceleration, deformation_gradient
from jaxphys.problems.ringing import Ringing, displacements, ringing


def error(name, resolution, **wrong):
    """The norm of a problem, with factors on some of the model's parameters or on gravity."""
    known = PROBLEMS[name]
    problem = known.build(resolution, "float64")
    model = problem.model
    gravity = wrong.pop("gravity", 1.0)
    parameters = model.parameters | {
        key: factor * model.parameters[key] for key, factor in wrong.items()
    }
    model = replace(model, parameters=parameters, gravity=gravity * model.gravity)
    problem = replace(problem, model=model)
    return known.norm(problem, solve(problem))


# The references.


@pytest.mark.parametrize("x", [0.1, 0.45, 0.9])
def test_poiseuille_obeys_the_diffusion_equation(x):
    truth, t = Poiseuille(), 0.2
    steps = 1e-4 * np.arange(-1, 2)
    along = [float(truth.travelled(jnp.asarray(x), jnp.asarray(t + d))) for d in steps]
    across = [float(truth.travelled(jnp.asarray(x + 10 * d), jnp.asarray(t))) for d in steps]
    acceleration = (along[0] - 2 * along[1] + along[2]) / 1e-8
    # What has been travelled obeys it integrated: u = nu s'' + G t.
    speed = (along[2] - along[0]) / 2e-4
    bent = (across[0] - 2 * across[1] + across[2]) / 1e-6
    assert np.isclose(speed, truth.kinematic * bent + truth.push * t, rtol=1e-3)
    assert 0 < acceleration < truth.push


def test_bingham_is_sheared_by_what_the_stress_has_beyond_the_yield_stress():
    truth = Bingham()
    for x in (0.1, 0.3, 0.7):
        slope = float(truth.speed(x + 1e-4) - truth.speed(x - 1e-4)) / 2e-4
        stress = truth.density * truth.push * (truth.half - x)
        assert np.isclose(
            truth.viscosity * slope, max(0.0, stress - truth.yield_stress), atol=1e-3 * stress
        )
        sheared = float(truth.elastic(x + 1e-4) - truth.elastic(x - 1e-4)) / 2e-4
        assert np.isclose(truth.shear * sheared, stress, rtol=1e-6)


def test_the_spinning_disc_balances_momentum():
    """Linear elasticity in plane strain, at small strain: residual of the second order."""
    truth = Disc(spin=1e-3)
    nu = truth.poisson
    lame = truth.youngs * nu / ((1 + nu) * (1 - 2 * nu))
    shear = truth.youngs / (2 * (1 + nu))

    def stress(F):
        inverse = jnp.linalg.inv(F).T
        return lame * jnp.log(jnp.linalg.det(F)) * inverse + shear * (F - inverse)

    X = jnp.array([0.5, 0.3, 0.0])
    force = body_acceleration(truth.motion, stress, truth.density, X, jnp.array(0.0))
    assert jnp.abs(force).max() < 1e-3 * truth.spin**2
    F = deformation_gradient(truth.motion, jnp.array([1.0, 0.0, 0.0]), jnp.array(0.0))
    edge = abs(float(stress(F)[0, 0]))
    F = deformation_gradient(truth.motion, jnp.array([0.1, 0.0, 0.0]), jnp.array(0.0))
    assert edge < 1e-3 * abs(float(stress(F)[0, 0]))


@pytest.mark.parametrize("hencky", [False, True])
def test_the_ringing_reference_has_converged_and_is_the_linear_wave_when_it_is_quiet(hencky):
    x = np.linspace(0.05, 0.95, 7)
    X = np.stack([x, x, x])
    truth = Ringing(hencky=hencky)
    twice = displacements(truth, X, modes=96, steps=4000)
    assert np.abs(displacements(truth, X) - twice).max() < 1e-8
    quiet = Ringing(speed=1e-5, hencky=hencky)
    time = quiet.duration * quiet.wave_speed
    linear = 1e-5 / np.pi * np.sin(np.pi * time) * np.cos(np.pi * x)
    np.testing.assert_allclose(displacements(quiet, X)[0], linear, rtol=1e-4, atol=1e-12)
    # Control: at its own amplitude the wave is no longer that one.
    loud = displacements(truth, X)[0] * 1e-5 / truth.speed
    assert np.abs(loud - linear).max() > 0.02 * np.abs(linear).max()


@pytest.mark.slow
def test_the_ringing_cube_converges_under_henckys_law_to_its_own_wave():
    coarse, fine = (ringing(Ringing(hencky=True), cells) for cells in (4, 8))
    end = solve(fine)
    error = displacement_errors(fine, end)[0]
    assert 1.5 < np.log2(displacement_errors(coarse, solve(coarse))[0] / error) < 2.5
    # Control: the other law's wave is another one.
    other = replace(fine, exact=ringing(Ringing(), 8).exact)
    assert displacement_errors(other, end)[0] > 1.5 * error


def test_the_angle_of_grains_is_that_of_plane_strain():
    sine = np.sin(np.radians(Grains().triaxial))
    assert np.isclose(2 * 3**0.5 * sine / (3 - sine), np.sin(np.radians(Grains().friction)))


# The solver.


@pytest.mark.parametrize(
    ("name", "levels", "order", "band"),
    [
        pytest.param("poiseuille", (4, 8, 16), 2.0, 0.35, marks=pytest.mark.slow),
        pytest.param("ringing-cube", (6, 9, 12), 2.0, 0.25, marks=pytest.mark.slow),
        ("taylor-green", (4, 8, 16), 2.0, 0.3),
    ],
)
def test_orders(name, levels, order, band):
    errors = [PROBLEMS[name].error(level, "float64") for level in levels]
    observed = observed_order([1 / level for level in levels], errors)
    assert abs(observed - order) < band, (observed, errors)


@pytest.mark.parametrize(
    ("name", "resolution", "most", "wrong"),
    [
        ("poiseuille", 8, 0.02, {"viscosity": 1.2}),
        ("bingham", 8, 0.04, {"shear_yield_stress": 0.7}),
        ("taylor-green", 8, 0.12, {"viscosity": 2.0}),
        ("ringing-cube", 9, 0.05, {"youngs_modulus": 1.3}),
        ("spinning-disc", 8, 0.01, {"youngs_modulus": 1.2}),
        ("cantilever", 2, 0.03, {"youngs_modulus": 1.3}),
        ("dam-break", 4, 0.03, {"gravity": 1.1}),
        ("sliding-block", 4, 0.06, {"gravity": 1.3}),
        ("sticking-block", 4, 0.04, {"gravity": jnp.array([2.0, 1.0, 1.0])}),
        ("hertz", 4, 0.3, {"youngs_modulus": 4.0}),
    ],
)
def test_the_solver_on_a_coarse_grid(name, resolution, most, wrong):
    assert error(name, resolution) < most
    assert error(name, resolution, **wrong) > most


@pytest.mark.slow
def test_tall_grains_run_out_as_they_do_in_channels():
    known = PROBLEMS["grains-2"]
    assert error("grains-2", 12) < known.floor
    assert error("grains-2", 12, friction_angle=1.8) > known.floor


@pytest.mark.slow
def test_the_copper_rod():
    assert error("taylor-bar", 2) < 0.05
    assert error("taylor-bar", 2, yield_stress=0.6) > 0.05
