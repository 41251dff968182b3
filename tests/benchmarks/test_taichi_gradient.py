"""Our gradient of a rollout against Taichi's automatic differentiation of the same rollout."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.mpm import block_case, model_and_state
from jaxphys.mpm.loop.rollout import rollout

STEPS = 8


def ours(case):
    """Value and gradients by Young's modulus (N,) and initial velocity (N, 3), in float32."""
    config, model, state = model_and_state(case)

    def loss(modulus, velocity):
        parameters = {**model.parameters, "youngs_modulus": modulus}
        changed = type(model)(model.mass, model.volume, parameters, model.gravity)
        moving = state._replace(velocity=velocity)
        end = rollout(config, changed, moving, dt=case["dt"], steps=STEPS)
        return jnp.mean(end.position**2)

    arguments = model.parameters["youngs_modulus"], state.velocity
    value, found = jax.jit(jax.value_and_grad(loss, argnums=(0, 1)))(*arguments)
    return value, found[0], found[1].T


def off(found, expected):
    """Size of the difference over the size of what is expected."""
    return np.linalg.norm(found - expected) / np.linalg.norm(expected)


@pytest.mark.slow  # Taichi compiles the transposes for a minute.
def test_gradients_agree_with_taichi():
    pytest.importorskip("taichi")
    from benchmarks.peers.taichi_mpm_grad import build

    case = block_case(4, 16)
    value_and_gradient, gradients = build(case, STEPS)
    first, second = value_and_gradient(), value_and_gradient()
    by_modulus, by_velocity = gradients()
    value, our_modulus, our_velocity = ours(case)
    assert first == pytest.approx(float(value), rel=1e-5)
    assert second == pytest.approx(first, rel=1e-5)
    assert off(by_velocity, our_velocity) < 1e-3
    assert off(by_modulus, our_modulus) < 1e-3
    # Control: a modulus wrong by one per cent shows.
    _, wrong, _ = ours(case | {"youngs_modulus": 1.01 * case["youngs_modulus"]})
    assert off(wrong, our_modulus) > 3e-3


def test_other_laws_are_refused():
    pytest.importorskip("taichi")
    from benchmarks.peers.taichi_mpm_grad import build

    with pytest.raises(ValueError, match="neo-Hookean only"):
        build(block_case(2, 8, "sand"), 1)
