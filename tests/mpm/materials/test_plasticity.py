import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.elasticity import lame
from jaxphys.mpm.materials.plasticity import (
    DRUCKER_PRAGER,
    PERFECT_VON_MISES,
    UNCORRECTED_DRUCKER_PRAGER,
    VON_MISES,
    friction_coefficient,
    triaxial_friction_angle,
)

DT = 1e-3
METAL = {"youngs_modulus": 1.0, "poisson_ratio": 0.3, "yield_stress": 0.05, "hardening": 0.2}
SAND = {"youngs_modulus": 1.0, "poisson_ratio": 0.3, "friction_angle": 35.0}
CASES = [(VON_MISES, METAL), (DRUCKER_PRAGER, SAND)]
IDS = ["von Mises", "Drucker-Prager"]
KEPT = jnp.zeros((1, 30))  # history that the energy does not read


def arrays(values, dtype=jnp.float64):
    return {name: jnp.asarray(value, dtype) for name, value in values.items()}


MU, LAM = (float(x) for x in lame(arrays(METAL)))


def principal(law, values, strains, kept=0.0):
    """Elastic log strains, principal stresses and history after an update of diag(exp(strains))."""
    F = jnp.asarray(np.diag(np.exp(strains))[:, :, None])
    F, tau, history = law.update(arrays(values), F, jnp.full((1, 1), kept), DT)
    assert np.abs(F[:, :, 0] - np.diag(np.diag(F[:, :, 0]))).max() < 1e-14
    return np.log(np.diag(F[:, :, 0])), np.diag(tau[:, :, 0]), float(history[0, 0])


def samples(count=30, size=0.15):
    random = np.random.default_rng(41)
    return np.eye(3)[:, :, None] + size * random.normal(size=(3, 3, count))


def pulled(plastic, values):
    """Log strains of a bar that is pulled until its plastic strain is `plastic` (Hencky strain adds
    up), and its stress: the textbook's uniaxial test.
    """
    stress = values["yield_stress"] + values["hardening"] * plastic
    nu = values["poisson_ratio"]
    elastic = stress / values["youngs_modulus"] * np.array([1, -nu, -nu])
    return elastic + plastic * np.array([1, -0.5, -0.5]), stress


@pytest.mark.parametrize("plastic", [1e-6, 1e-3, 0.5])
def test_a_bar_yields_at_the_handbooks_stress_and_hardens_with_its_modulus(plastic):
    """In one step from rest, which is exact where all strains stay in proportion."""
    for values in (METAL, METAL | {"hardening": 0.0}):
        total, stress = pulled(plastic, values)
        _, tau, strain = principal(VON_MISES, values, total)
        np.testing.assert_allclose(tau, [stress, 0, 0], atol=1e-13)
        assert strain == pytest.approx(plastic, rel=1e-9)
        # From the yield point on, stress over strain has the slope E H / (E + H).
        start, first = pulled(0.0, values)
        E, H = values["youngs_modulus"], values["hardening"]
        assert (tau[0] - first) / (total[0] - start[0]) == pytest.approx(E * H / (E + H), abs=1e-7)


def test_a_bar_below_the_yield_stress_is_elastic_and_above_it_is_not():
    start, stress = pulled(0.0, METAL)
    for factor, yields in ((1 - 1e-9, False), (1 + 1e-9, True)):
        _, tau, strain = principal(VON_MISES, METAL, factor * start)
        assert (strain > 0) == yields
        assert tau[0] == pytest.approx(stress, rel=1e-8)


def test_a_bar_pulled_in_small_steps():
    """Sideways strain is what keeps the sides free; the same bar as in one step."""
    values, F, history = arrays(METAL), jnp.eye(3)[:, :, None], jnp.zeros((1, 1))
    update, before = jax.jit(VON_MISES.update), np.zeros(3)
    for plastic in np.linspace(0, 0.3, 31):
        total, stress = pulled(plastic, METAL)
        F = jnp.asarray(np.diag(np.exp(total - before)))[:, :, None] * F
        F, tau, history = update(values, F, history, DT)
        before = total
        np.testing.assert_allclose(np.diag(tau[:, :, 0]), [stress, 0, 0], atol=1e-12)
        assert float(history[0, 0]) == pytest.approx(plastic, abs=1e-12)


def test_metal_without_hardening_is_the_same_without_its_memory():
    values = METAL | {"hardening": 0.0}
    assert VON_MISES.reduced(METAL) is VON_MISES
    assert VON_MISES.reduced(values) is PERFECT_VON_MISES
    mixed = METAL | {"hardening": np.array([0.0, 0.1])}
    assert VON_MISES.reduced(mixed) is VON_MISES
    F = jnp.asarray(samples())
    full, tau, _ = VON_MISES.update(arrays(values), F, jnp.full((1, 30), 0.3), DT)
    kept, same, history = PERFECT_VON_MISES.update(arrays(values), F, jnp.zeros((0, 30)), DT)
    np.testing.assert_allclose(kept, full, atol=1e-15)
    np.testing.assert_allclose(same, tau, atol=1e-15)
    assert history.shape == (0, 30)


def test_von_mises_uniaxial_and_shear():
    limit, growth = METAL["yield_stress"] * np.sqrt(2 / 3), METAL["hardening"] * 2 / 3
    for strains in ([0.2, 0, 0], [0.1, -0.1, 0], [-0.2, 0.05, 0.05]):
        e = np.array(strains)
        dev = e - e.mean()
        norm = np.linalg.norm(dev)
        flow = (2 * MU * norm - limit) / (2 * MU + growth)
        elastic, tau, plastic = principal(VON_MISES, METAL, e)
        np.testing.assert_allclose(elastic, e - flow * dev / norm, atol=1e-14)
        np.testing.assert_allclose(tau, 2 * MU * elastic + LAM * e.sum(), atol=1e-14)
        assert plastic == pytest.approx(np.sqrt(2 / 3) * flow, rel=1e-12)
        # On the hardened surface exactly, and no plastic volume.
        assert np.linalg.norm(tau - tau.mean()) == pytest.approx(limit + growth * flow, rel=1e-12)
        assert elastic.sum() == pytest.approx(e.sum(), abs=1e-14)


def test_von_mises_simple_shear_strength():
    """F = I + g e_x e_y: shear stress saturates at sigma_Y / sqrt(3) without hardening."""
    values = arrays(METAL | {"hardening": 0.0})
    F, history = jnp.eye(3)[:, :, None], jnp.zeros((1, 1))
    advance = jnp.eye(3).at[0, 1].set(2e-3)
    for _ in range(100):
        F = jnp.einsum("ij,jkn->ikn", advance, F)
        F, tau, history = VON_MISES.update(values, F, history, DT)
    assert float(tau[0, 1, 0]) == pytest.approx(METAL["yield_stress"] / np.sqrt(3), rel=1e-2)
    assert float(history[0, 0]) > 0.05


@pytest.mark.parametrize(("law", "values"), CASES, ids=IDS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_return_maps_are_idempotent(law, values, dtype):
    F = jnp.asarray(samples(), dtype)
    update = jax.jit(law.update)
    first = update(arrays(values, dtype), F, jnp.zeros((1, F.shape[-1]), dtype), DT)
    again = update(arrays(values, dtype), first[0], first[2], DT)
    eps = np.finfo(dtype).eps
    for a, b in zip(first, again, strict=True):
        assert a.dtype == dtype
        np.testing.assert_allclose(a, b, atol=60 * eps)
    assert np.abs(first[0] - F).max() > 0.01  # it did yield


@pytest.mark.parametrize(("law", "values"), CASES, ids=IDS)
def test_stress_is_the_derivative_of_the_energy_of_what_is_left(law, values):
    values = arrays(values)
    F, tau, _ = law.update(values, jnp.asarray(samples()), jnp.zeros((1, 30)), DT)
    P = jax.grad(lambda F: jnp.sum(law.energy(values, F, KEPT)))(F)
    np.testing.assert_allclose(tau, jnp.einsum("ikn,jkn->ijn", P, F), atol=1e-13)
    assert (law.energy(values, F, KEPT) >= 0).all()


@pytest.mark.parametrize(("law", "values"), CASES, ids=IDS)
def test_plastic_flow_does_not_raise_the_energy(law, values):
    trial = jnp.asarray(samples())
    F, _, _ = law.update(arrays(values), trial, jnp.zeros((1, 30)), DT)
    values = arrays(values)
    assert (law.energy(values, F, KEPT) <= law.energy(values, trial, KEPT) + 1e-15).all()


def test_metal_below_yield_keeps_its_gradient_bit_for_bit():
    F = jnp.asarray(samples(size=0.002), jnp.float32)
    kept, _, history = VON_MISES.update(
        arrays(METAL, jnp.float32), F, jnp.zeros((1, 30), jnp.float32), DT
    )
    np.testing.assert_array_equal(kept, F)
    np.testing.assert_array_equal(history, 0)


def sheared(angle, test):
    """Principal stresses of sand under pressure, sheared at constant volume until they are steady:
    along a bar for "triaxial compression", in a plane for "plane strain".
    """
    direction = {"triaxial compression": [-1, 0.5, 0.5], "plane strain": [-1, 1, 0]}[test]
    values = SAND | {"friction_angle": angle}
    e = np.full(3, -0.02)
    for _ in range(60):
        e, tau, _ = principal(DRUCKER_PRAGER, values, e + 0.002 * np.array(direction))
    return np.sort(tau)


def mohr_coulomb(tau):
    """The friction angle [degrees] of Mohr and Coulomb's law, from principal stresses."""
    return np.degrees(np.arcsin((tau[0] - tau[2]) / (tau[0] + tau[2])))


def test_the_friction_angle_is_that_of_the_test_that_it_names():
    assert mohr_coulomb(sheared(30.0, "triaxial compression")) == pytest.approx(30.0, abs=1e-6)
    # The same sand in plane strain, which is why the other angle has a name of its own.
    assert mohr_coulomb(sheared(30.0, "plane strain")) == pytest.approx(43.85, abs=0.01)
    matched = float(triaxial_friction_angle(30.0))
    assert mohr_coulomb(sheared(matched, "plane strain")) == pytest.approx(30.0, abs=1e-6)


def test_friction_coefficients_in_closed_form():
    assert float(friction_coefficient(0.0)) == float(friction_coefficient(0.0, "plane strain")) == 0
    half = 0.5  # the sine of 30 degrees
    slope = np.sqrt(2 / 3) * 2 * half / (3 - half)
    assert float(friction_coefficient(30.0)) == pytest.approx(slope, rel=1e-12)
    plane = float(friction_coefficient(30.0, "plane strain"))
    assert plane == pytest.approx(np.sqrt(2) * half / 3, rel=1e-12)
    back = float(friction_coefficient(triaxial_friction_angle(30.0)))
    assert back == pytest.approx(plane, rel=1e-12)
    with pytest.raises(InputError, match="'plane strain'"):
        friction_coefficient(30.0, "plane stress")


def test_sand_without_volume_correction_stays_looser():
    """Pulled apart and pressed back it resists at once; with it, only when it has closed."""
    values = arrays(SAND)
    F = jnp.asarray(np.exp(0.04) * np.eye(3)[:, :, None])
    stresses = {}
    for law in (DRUCKER_PRAGER, UNCORRECTED_DRUCKER_PRAGER):
        opened, _, history = law.update(values, F, jnp.zeros((len(law.history), 1)), DT)
        _, tau, _ = law.update(values, np.exp(-0.02) * opened, history, DT)
        stresses[law] = float(tau[0, 0, 0])
    assert stresses[DRUCKER_PRAGER] == 0
    bulk = (2 * MU + 3 * LAM) * -0.02
    assert stresses[UNCORRECTED_DRUCKER_PRAGER] == pytest.approx(bulk, rel=1e-12)
    # Where nothing has come apart the two are the same.
    pressed = jnp.asarray(samples() - 0.3 * np.eye(3)[:, :, None])
    one = DRUCKER_PRAGER.update(values, pressed, jnp.zeros((1, 30)), DT)
    other = UNCORRECTED_DRUCKER_PRAGER.update(values, pressed, jnp.zeros((0, 30)), DT)
    np.testing.assert_allclose(one[0], other[0], atol=1e-14)
    np.testing.assert_allclose(one[1], other[1], atol=1e-14)


def test_sand_slides_on_its_cone():
    alpha = float(friction_coefficient(35.0))
    e = np.array([0.03, -0.06, -0.01])
    dev, total = e - e.mean(), e.sum()
    norm = np.linalg.norm(dev)
    flow = norm + (3 * LAM + 2 * MU) / (2 * MU) * total * alpha
    assert flow > 0
    elastic, tau, kept = principal(DRUCKER_PRAGER, SAND, e)
    np.testing.assert_allclose(elastic, e - flow * dev / norm, atol=1e-14)
    # On the cone: |dev tau| = -(3 lambda + 2 mu) tr(e) alpha = -tr(tau) alpha.
    assert np.linalg.norm(tau - tau.mean()) == pytest.approx(-tau.sum() * alpha, rel=1e-12)
    assert kept == 0


def test_sand_under_pressure_alone_is_elastic_and_apart_is_free():
    e = np.full(3, -0.05)
    elastic, tau, kept = principal(DRUCKER_PRAGER, SAND, e)
    np.testing.assert_allclose(elastic, e, atol=1e-15)
    np.testing.assert_allclose(tau, (2 * MU + 3 * LAM) * e, atol=1e-14)
    assert kept == 0
    elastic, tau, kept = principal(DRUCKER_PRAGER, SAND, [0.1, -0.02, 0.01])
    np.testing.assert_allclose(elastic, 0, atol=1e-15)
    np.testing.assert_array_equal(tau, 0)
    assert kept == pytest.approx(0.09)


def test_sand_gives_back_the_volume_it_gained():
    _, _, kept = principal(DRUCKER_PRAGER, SAND, [0.04, 0.04, 0.04])
    assert kept == pytest.approx(0.12)
    # Half of it back: no stress yet, and the rest is still kept.
    _, tau, kept = principal(DRUCKER_PRAGER, SAND, [-0.02] * 3, kept)
    np.testing.assert_array_equal(tau, 0)
    assert kept == pytest.approx(0.06)
    # Beyond it: it resists only what exceeds the kept volume.
    elastic, tau, kept = principal(DRUCKER_PRAGER, SAND, [-0.03] * 3, kept)
    assert elastic.sum() == pytest.approx(-0.03) and kept == 0
    assert tau.sum() == pytest.approx((2 * MU + 3 * LAM) * -0.03)
    # Without the correction the sand would have resisted all of it, and gained volume for good.
    _, uncorrected, _ = principal(DRUCKER_PRAGER, SAND, [-0.03] * 3, 0.0)
    assert uncorrected.sum() == pytest.approx(3 * tau.sum())


def test_frictionless_sand_bears_no_shear():
    _, tau, _ = principal(DRUCKER_PRAGER, SAND | {"friction_angle": 0.0}, [0.02, -0.08, -0.01])
    np.testing.assert_allclose(tau, tau.mean(), atol=1e-15)
    assert tau.mean() < 0


@pytest.mark.parametrize(("law", "values"), CASES, ids=IDS)
def test_gradients_against_central_differences(law, values):
    random = np.random.default_rng(42)
    F, values = jnp.asarray(samples()), arrays(values)
    kept = jnp.full((1, 30), 0.02)
    dF = random.normal(size=F.shape)
    weights = [random.normal(size=shape) for shape in (F.shape, F.shape, kept.shape)]

    @jax.jit
    def loss(F, values, kept):
        return sum(
            jnp.sum(w * x) for w, x in zip(weights, law.update(values, F, kept, DT), strict=True)
        )

    gF, gv, gk = jax.jit(jax.grad(loss, (0, 1, 2)))(F, values, kept)
    h = 1e-7
    along = (loss(F + h * dF, values, kept) - loss(F - h * dF, values, kept)) / (2 * h)
    assert float(jnp.sum(gF * dF)) == pytest.approx(float(along), rel=1e-5)
    along = (loss(F, values, kept + h) - loss(F, values, kept - h)) / (2 * h)
    assert float(jnp.sum(gk)) == pytest.approx(float(along), rel=1e-5)
    for name, value in values.items():
        step = h * max(1.0, abs(float(value)))
        up = loss(F, values | {name: value + step}, kept)
        down = loss(F, values | {name: value - step}, kept)
        assert float(gv[name]) == pytest.approx(float(up - down) / (2 * step), rel=1e-4, abs=1e-6)


@pytest.mark.parametrize(("law", "values"), CASES, ids=IDS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gradients_at_rest_are_finite(law, values, dtype):
    F = jnp.asarray(np.eye(3)[:, :, None], dtype)
    values, kept = arrays(values, dtype), jnp.zeros((1, 1), dtype)

    def loss(F, values, kept):
        return sum(jnp.sum(x) for x in law.update(values, F, kept, DT))

    gradient = jax.grad(loss, (0, 1, 2))(F, values, kept)
    assert all(np.isfinite(x).all() for x in jax.tree.leaves(gradient))


@pytest.mark.parametrize("side", [-1, 1])
def test_one_sided_derivatives_at_the_yield_edge(side):
    """Shear strain e = (t, -t, 0) reaches yield at t with 2 mu t = sigma_Y / sqrt(3)."""
    edge = METAL["yield_stress"] / (2 * MU * np.sqrt(3))
    values = arrays(METAL)

    def stress(t):
        F = jnp.diag(jnp.exp(jnp.stack([t, -t, 0 * t])))[:, :, None]
        return VON_MISES.update(values, F, jnp.zeros((1, 1)), DT)[1][0, 0, 0]

    t, h = edge * (1 + side * 1e-6), 1e-9
    slope = float(jax.grad(stress)(t))
    assert slope == pytest.approx(float(stress(t + h) - stress(t - h)) / (2 * h), rel=1e-5)
    H = METAL["hardening"] * 2 / 3
    expected = 2 * MU if side < 0 else 2 * MU * H / (2 * MU + H)
    assert slope == pytest.approx(expected, rel=1e-4)
