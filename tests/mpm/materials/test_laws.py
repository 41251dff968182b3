"""What holds for every law beyond the five of the paper, whatever it describes."""

from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core import algebra
from jaxphys.mpm.materials.catalogue import MATERIALS
from jaxphys.mpm.materials.fibres import FIBRES
from jaxphys.mpm.stepping.bounds import moduli_of, rest_moduli

NAMES = ("water", "cream", "plasticine", "snow", "wet-sand", "memory-foam", "muscle")
# Without the clock of its contractions, which "long" steps would turn (test_contraction.py).
LAWS = {name: MATERIALS[name].law for name in NAMES} | {"muscle": FIBRES}
# In units in which stresses are of order one, so that strains of some per cent yield.
NUMBERS = {
    "youngs_modulus": 1.0,
    "poisson_ratio": 0.3,
    "bulk_modulus": 2.0,
    "viscosity": 0.01,
    "shear_modulus": 0.5,
    "shear_yield_stress": 0.01,
    "consistency": 0.02,
    "flow_index": 0.6,
    "yield_stress": 0.02,
    "plastic_viscosity": 0.03,
    "critical_compression": 0.02,
    "critical_stretch": 0.01,
    "packing_hardening": 8.0,
    "friction_angle": 35.0,
    "cohesion": 0.01,
    "relaxing_modulus": 0.7,
    "relaxation_time": 0.3,
    "fibre_stiffness": 0.6,
    "fibre_stiffening": 0.8,
    "fibre_azimuth": 25.0,
    "fibre_elevation": 40.0,
}
DT = 0.05
COUNT = 12


@cache
def states():
    """Deformation gradients: none, equal stretches, below what yields, beyond it, turned."""
    random = np.random.default_rng(3)
    general = random.normal(size=(4, 3, 3))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    F = [
        np.eye(3),
        np.diag([0.9, 0.9, 0.9]),
        np.diag([1.06, 1.06, 0.9]),
        np.diag([1.001, 1.001, 0.997]),
        *(np.eye(3) + 2e-3 * general),
        *(np.eye(3) + 0.08 * general[:3]),
        turn @ (np.eye(3) + 0.08 * general[3]),
    ]
    return jnp.asarray(np.stack(F, axis=-1))


def prepared(law, dtype=jnp.float64, **changes):
    numbers = NUMBERS | changes
    return {name: jnp.full(COUNT, numbers[name], dtype) for name in law.parameters}


def history_of(law, dtype=jnp.float64):
    """A little has happened before."""
    start = law.at_start(jnp.zeros(COUNT, dtype))
    return start + 0.01 * (np.arange(COUNT) % 3).astype(dtype)


def turn():
    R = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return jnp.asarray(R * np.sign(np.linalg.det(R)))


@pytest.fixture(scope="module", params=NAMES)
def seen(request):
    """A law and all that one program tells of it, so that it is compiled once."""
    law = LAWS[request.param]

    @jax.jit
    def look(raw, F, history):
        values = law.prepare(raw)
        # So long a step that nothing flows any more.
        long = law.update(values, F, history, 1e12)
        R = turn()
        turned = jnp.einsum("ij,jkn->ikn", R, F)
        if law.viscosity is not None:  # its F is a multiple of the identity before a step
            turned = jnp.einsum("ijn,kj->ikn", turned, R)
        rest = jnp.broadcast_to(jnp.eye(3)[..., None], F.shape)
        return {
            "long": long,
            "again": law.update(values, long[0], long[2], 1e12),
            "derived": jax.grad(lambda F: jnp.sum(law.energy(values, F, long[2])))(long[0]),
            "energy": law.energy(values, long[0], long[2]),
            "energy before": law.energy(values, F, history),
            "short": law.update(values, F, history, DT),
            "turned": law.update(values, turned, history, DT),
            "rest": rest_moduli(law, values, jnp.ones(COUNT)),
            "moduli": moduli_of(law, values, rest),
        }

    return law, look(prepared(law), states(), history_of(law))


def test_what_is_no_friction_of_the_stress_is_the_derivative_of_the_energy(seen):
    _, found = seen
    F, tau, _ = found["long"]
    expected = algebra.matmul_transpose(found["derived"], F)
    np.testing.assert_allclose(tau, expected, atol=1e-11)
    np.testing.assert_allclose(tau, np.swapaxes(tau, 0, 1), atol=1e-15)
    assert (found["energy"] > -1e-15).all()


def test_return_maps_are_idempotent_and_lower_the_energy(seen):
    law, found = seen
    for ours, theirs in zip(found["again"][:2], found["long"][:2], strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)
    # Snow gets stiffer, and sand gives back volume: their energies may grow.
    if law.hardened is None and "kept_log_volume" not in law.history_names:
        assert (found["energy"] <= found["energy before"] + 1e-14).all()


def test_moduli_at_rest_are_those_of_the_derivative(seen):
    law, found = seen
    if law.moduli is not None:
        # What pulls only when stretched is as stiff as that at rest; see test_fibres.py.
        assert (found["rest"][1] >= found["moduli"][1] / 1.02 - 1e-12).all()
        return
    for ours, derived in zip(found["rest"], found["moduli"], strict=True):
        np.testing.assert_allclose(ours, derived, rtol=1e-6)


def test_stress_turns_with_the_matter(seen):
    _, found = seen
    R, plain = turn(), found["short"][1]
    expected = jnp.einsum("ij,jkn,lk->iln", R, plain, R)
    np.testing.assert_allclose(found["turned"][1], expected, atol=1e-12)


def total(law, weights, F, values, history, dt):
    moved = law.update(law.prepare(values), F, history, dt)
    return sum(jnp.sum(w * x) for w, x in zip(weights, moved, strict=True)), moved


def with_gradient(law, dtype):
    """Compiled: the weighted sum of all that a law gives, what it gives, and the gradient."""
    random = np.random.default_rng(9)
    shapes = ((3, 3, COUNT), (3, 3, COUNT), (len(law.history), COUNT))
    weights = tuple(jnp.asarray(random.normal(size=shape), dtype) for shape in shapes)
    program = jax.value_and_grad(partial(total, law, weights), argnums=(0, 1, 2, 3), has_aux=True)
    return jax.jit(program)


def test_gradients_against_central_differences(seen):
    """By F, every parameter, the history and dt, on both sides of yield, at equal stretches."""
    law, _ = seen
    random = np.random.default_rng(11)
    program = with_gradient(law, jnp.float64)
    F, history = states(), history_of(law)
    if law.moduli is not None:
        # Fibres start to pull at F = I, where there is no derivative.
        F = F.at[:, :, 0].set(jnp.diag(jnp.array([1.01, 1.02, 0.99])))
    at = (F, prepared(law), history, jnp.asarray(DT))
    _, gradients = program(*at)

    def along(direction, h):
        def moved(step):
            return program(*jax.tree.map(lambda x, d: x + step * d, at, direction))[0][0]

        return float(moved(h) - moved(-h)) / (2 * h)

    zero = jax.tree.map(np.zeros_like, at)
    directions = [(random.normal(size=F.shape), *zero[1:])]
    for name in at[1]:
        changed = zero[1] | {name: np.asarray(at[1][name]) * random.uniform(0.5, 1, COUNT)}
        directions.append((zero[0], changed, *zero[2:]))
    # Where nothing has happened yet, wet sand is whole, and not beside it.
    directions.append((*zero[:2], random.normal(size=history.shape) * (history != 0), zero[3]))
    directions.append((*zero[:3], np.asarray(DT)))
    for direction in directions:
        slope = sum(
            float(np.sum(np.asarray(g) * d))
            for g, d in zip(jax.tree.leaves(gradients), jax.tree.leaves(direction), strict=True)
        )
        assert slope == pytest.approx(along(direction, 1e-6), rel=2e-6, abs=2e-8)


def test_float32_follows_float64_and_its_gradients_are_finite(seen):
    law, found = seen
    narrow = (states().astype(np.float32), prepared(law, jnp.float32))
    history, dt = history_of(law, jnp.float32), np.float32(DT)
    (_, moved), gradients = with_gradient(law, jnp.float32)(*narrow, history, dt)
    for a, b in zip(moved, found["short"], strict=True):
        assert a.dtype == jnp.float32 and a.shape == b.shape
        np.testing.assert_allclose(a, b, atol=3e-5)
    assert all(bool(jnp.isfinite(g).all()) for g in jax.tree.leaves(gradients))
