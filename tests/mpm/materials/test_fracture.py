import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.mpm.materials.elasticity import HENCKY, lame
from jaxphys.mpm.materials.fracture import FRACTURE, damage_of_strain, number_of_pieces

DT = 1e-3
VALUES = {
    "youngs_modulus": jnp.asarray(1.0),
    "poisson_ratio": jnp.asarray(0.2),
    "fracture_strain": jnp.asarray(0.05),
    "softening_strain": jnp.asarray(0.1),
    "friction_angle": jnp.asarray(30.0),
}
MU, LAM = (float(x) for x in lame(VALUES))


def update(strains, damage=0.0, volume=0.0):
    """Elastic log strains, principal stress and history after one trial strain."""
    F = jnp.asarray(np.diag(np.exp(strains))[:, :, None])
    history = jnp.asarray([[damage], [volume]])
    F, tau, history = FRACTURE.update(VALUES, F, history, DT)
    return np.log(np.diag(F[:, :, 0])), np.diag(tau[:, :, 0]), history[:, 0]


def test_below_the_threshold_it_is_hencky_elasticity():
    random = np.random.default_rng(81)
    F = jnp.asarray(np.eye(3)[:, :, None] + 0.01 * random.normal(size=(3, 3, 10)))
    kept, tau, damage = FRACTURE.update(VALUES, F, jnp.zeros((2, 10)), DT)
    np.testing.assert_array_equal(kept, F)
    np.testing.assert_array_equal(damage, 0)
    np.testing.assert_allclose(tau, HENCKY.update(VALUES, F, jnp.zeros((0, 10)), DT)[1], atol=1e-16)


def test_tension_falls_along_a_line_and_ends():
    for strain in (0.05, 0.08, 0.12, 0.149):
        elastic, tau, (damage, _) = update([strain, 0, 0])
        carried = 0.05 * (0.15 - strain) / 0.1
        np.testing.assert_allclose(
            tau, [(2 * MU + LAM) * carried, *[LAM * carried] * 2], atol=1e-15
        )
        assert elastic[0] == pytest.approx(strain)
        assert 0 <= damage < 1
    elastic, tau, (damage, volume) = update([0.3, 0, 0])
    np.testing.assert_allclose(tau, 0, atol=1e-16)
    np.testing.assert_allclose(elastic, 0, atol=1e-15)
    assert damage == 1 and volume == pytest.approx(0.3)


def test_damage_is_irreversible_and_compression_is_kept():
    _, _, (damage, _) = update([0.1, 0, 0])
    assert 0 < damage < 1
    _, tau, (after, _) = update([0.02, 0, 0], damage)
    assert after == damage
    assert tau[0] == pytest.approx((1 - damage) * (2 * MU + LAM) * 0.02)
    _, tau, _ = update([-0.02, 0, 0], damage)
    assert tau[0] == pytest.approx(-(2 * MU + LAM) * 0.02)


def test_a_crack_must_close_before_it_pushes():
    _, tau, (damage, volume) = update([-0.02] * 3, 1.0, volume=0.1)
    np.testing.assert_array_equal(tau, 0)
    assert damage == 1 and volume == pytest.approx(0.04)
    elastic, tau, (_, volume) = update([-0.02] * 3, 1.0, volume=float(volume))
    assert volume == 0 and elastic.sum() == pytest.approx(-0.02)
    assert tau.sum() == pytest.approx((2 * MU + 3 * LAM) * -0.02)


def test_opening_and_closing_a_crack_gives_back_no_work():
    """A negative control is the law without the kept volume: it pushes as soon as strain turns."""
    strain, damage, volume, work = 0.3, 0.0, 0.0, 0.0
    for change in [0.0] + [0.01] * 10 + [-0.01] * 35:
        elastic, tau, (damage, volume) = update([strain + change, 0, 0], damage, float(volume))
        strain = elastic[0]
        work += tau[0] * change
    assert abs(work) < 1e-15
    _, forgetful, _ = update([-0.01, 0, 0], 1.0, 0.0)
    assert forgetful[0] < 0


def test_damage_rises_from_zero_to_one_without_a_jump():
    strain = np.linspace(0, 0.3, 601)
    damage = np.asarray(damage_of_strain(jnp.asarray(strain), 0.05, 0.1))
    assert damage[0] == 0 and damage[-1] == 1
    steps = np.diff(damage)
    assert (steps >= 0).all() and steps.max() < 0.02


def test_stress_is_the_derivative_of_the_energy_that_damage_leaves():
    """Sound, damaged and broken particles, the last ones pressed together and pulled apart."""
    random = np.random.default_rng(82)
    trial = np.eye(3)[:, :, None] + 0.01 * random.normal(size=(3, 3, 12))
    trial[:, :, 10] -= 0.04 * np.eye(3)
    trial[:, :, 11] += 0.04 * np.eye(3)
    damage = np.array([*np.linspace(0, 0.9, 10), 1, 1])
    history = jnp.stack([jnp.asarray(damage), jnp.zeros(12)])
    F, tau, history = FRACTURE.update(VALUES, jnp.asarray(trial), history, DT)
    energy = FRACTURE.energy(VALUES, F, history)
    P = jax.grad(lambda F: jnp.sum(FRACTURE.energy(VALUES, F, history)))(F)
    np.testing.assert_allclose(tau, jnp.einsum("ikn,jkn->ijn", P, F), atol=1e-14)
    assert (energy[:11] > 0).all() and energy[11] == pytest.approx(0, abs=1e-30)
    sound = HENCKY.energy(VALUES, F, jnp.zeros((0, 12)))
    assert energy[0] == pytest.approx(float(sound[0]), rel=1e-12)
    lost = sound[1:10] - energy[1:10]
    assert (lost >= 0).all() and lost.max() > 0.1 * sound[1:10].max()


def test_gradients_against_central_differences():
    random = np.random.default_rng(83)
    F = jnp.asarray(np.eye(3)[:, :, None] + 0.08 * random.normal(size=(3, 3, 20)))
    damage = jnp.stack([jnp.full(20, 0.1), jnp.full(20, 0.05)])
    dF = random.normal(size=F.shape)
    weights = [random.normal(size=x.shape) for x in (F, F, damage)]

    @jax.jit
    def loss(F, values):
        parts = FRACTURE.update(values, F, damage, DT)
        return sum(jnp.sum(w * x) for w, x in zip(weights, parts, strict=True))

    gF, gv = jax.jit(jax.grad(loss, (0, 1)))(F, VALUES)
    h = 1e-7
    along = (loss(F + h * dF, VALUES) - loss(F - h * dF, VALUES)) / (2 * h)
    assert float(jnp.sum(gF * dF)) == pytest.approx(float(along), rel=1e-5)
    for name, value in VALUES.items():
        up = loss(F, VALUES | {name: value + h})
        down = loss(F, VALUES | {name: value - h})
        assert float(gv[name]) == pytest.approx(float(up - down) / (2 * h), rel=1e-5, abs=1e-6)


def lattice(offset):
    axis = 0.1 * np.arange(3)
    return np.stack(np.meshgrid(axis, axis, axis), -1).reshape(-1, 3) + offset


def test_pieces_are_counted():
    two = np.concatenate([lattice(0.0), lattice([0.5, 0, 0])])
    assert number_of_pieces(two, 0.11) == 2
    assert number_of_pieces(two, 0.31) == 1
    assert number_of_pieces(two, 0.09) == len(two)
    dusty = np.concatenate([two, [[5.0, 5.0, 5.0]]])
    assert number_of_pieces(dusty, 0.11) == 3
    assert number_of_pieces(dusty, 0.11, minimum_size=2) == 2
    assert number_of_pieces(np.zeros((0, 3)), 1.0) == 0


@pytest.mark.parametrize(
    ("positions", "radius", "message"),
    [
        (np.zeros((3, 4)), 1.0, "shape"),
        (np.full((2, 3), np.nan), 1.0, "finite"),
        (np.zeros((2, 3)), 0.0, "radius"),
    ],
)
def test_counting_refuses_what_it_cannot_count(positions, radius, message):
    with pytest.raises(InputError, match=message):
        number_of_pieces(positions, radius)
