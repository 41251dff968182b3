import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import step
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.state import Config, Model, initial_state
from jaxphys.mpm.transfer import scatter, stencil

from .cases import block, public

jit_step = jax.jit(step, static_argnums=0)


def free(model):
    return Model(model.mass, model.volume, model.parameters, jnp.zeros(3))


def angular_momentum(grid, mass, x, v, C):
    """sum m x v + m D axial(C), D = dx^2 / 4: the spin that APIC keeps (Jiang et al. 2015)."""
    spin = jnp.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], 1)
    return jnp.sum(mass[:, None] * (jnp.cross(x, v) + grid.spacing**2 / 4 * spin), axis=0)


def test_mass_on_the_grid_is_the_particles_mass():
    config, model, state = block()
    whole = config.computed
    at = stencil(whole, jnp.zeros(3, jnp.int32), state.position)
    rows = jnp.zeros((whole.nodes, 4))
    rows = scatter(whole, at, rows, model.mass, state.velocity, state.affine)
    np.testing.assert_allclose(jnp.sum(rows[:, 3]), jnp.sum(model.mass), rtol=1e-14)


def test_momentum_and_angular_momentum_are_kept():
    config, model, state = block()
    model = free(model)
    x, v, C, _ = public(state)
    linear = jnp.sum(model.mass[:, None] * v, axis=0)
    angular = angular_momentum(config.grid, model.mass, x, v, C)
    spinless = angular_momentum(config.grid, model.mass, x, v, 0 * C)
    for _ in range(5):
        state = jit_step(config, model, state, 1e-3)
    x, v, C, _ = public(state)
    scale = float(jnp.sum(model.mass) * jnp.abs(v).max())
    after = jnp.sum(model.mass[:, None] * v, axis=0)
    np.testing.assert_allclose(after, linear, atol=1e-13 * scale)
    after = angular_momentum(config.grid, model.mass, x, v, C)
    np.testing.assert_allclose(after, angular, atol=1e-13 * scale)
    # Without the spin part it is not kept: the test can fail.
    after = angular_momentum(config.grid, model.mass, x, v, 0 * C)
    assert float(jnp.abs(after - spinless).max()) > 1e-6 * scale


def test_gravity_adds_its_impulse_exactly():
    config, model, state = block()
    before = jnp.sum(model.mass * state.velocity, axis=1)
    state = jit_step(config, model, state, 1e-3)
    after = jnp.sum(model.mass * state.velocity, axis=1)
    expected = 1e-3 * jnp.sum(model.mass) * model.gravity
    np.testing.assert_allclose(after - before, expected, atol=1e-13)


def lattice_block(cells, spacing, shape, start):
    """Particles at the corners of a regular lattice of two per cell and axis."""
    line = [start + spacing / 2 * (np.arange(2 * n) + 0.5) for n in cells]
    position = np.stack(np.meshgrid(*line, indexing="ij"), -1).reshape(-1, 3)
    count = len(position)
    config = Config(Grid(shape, spacing), ((NEO_HOOKEAN, 0, count),))
    model = Model(
        jnp.full(count, 1000 * spacing**3 / 8),
        jnp.full(count, spacing**3 / 8),
        {"youngs_modulus": jnp.full(count, 1e5), "poisson_ratio": jnp.full(count, 0.3)},
        jnp.zeros(3),
    )
    return config, model, position


def test_rigid_motion_costs_nothing():
    config, model, position = lattice_block((3, 3, 3), 0.1, (12, 12, 12), 0.4)
    centre, spin, drift = position.mean(0), np.array([0.3, -0.2, 0.9]), np.array([0.2, 0.1, 0.0])
    W = np.array([[0, -spin[2], spin[1]], [spin[2], 0, -spin[0]], [-spin[1], spin[0], 0]])
    count = len(position)
    state = initial_state(
        config,
        position,
        velocity=drift + (position - centre) @ W.T,
        affine=np.broadcast_to(W, (count, 3, 3)),
    )
    end = state
    dt, steps = 1e-4, 20
    for _ in range(steps):
        end = jit_step(config, model, end, dt)
    _, v, C, F = public(end)
    # The velocity of a particle is that at its old place, so that in the angle turned the strain
    # is of second order and the change of C of first; without C the strain would be of first.
    angle = steps * dt * np.linalg.norm(spin)
    stretch = np.einsum("pki,pkj->pij", F, F) - np.eye(3)
    assert np.abs(stretch).max() < 1.5 * angle**2
    np.testing.assert_allclose(C, np.broadcast_to(W, C.shape), atol=1.5 * angle)
    np.testing.assert_allclose(v.mean(0), drift, atol=1e-13)
    # A translation alone is exact.
    end = initial_state(config, position, velocity=np.broadcast_to(drift, position.shape))
    for _ in range(steps):
        end = jit_step(config, model, end, dt)
    np.testing.assert_allclose(public(end)[0], position + steps * dt * drift, atol=1e-13)
    np.testing.assert_allclose(public(end)[3], np.broadcast_to(np.eye(3), F.shape), atol=1e-13)


def test_uniform_stress_makes_no_force_inside():
    """Patch test: with uniform F, particles far from the surface feel nothing."""
    config, model, position = lattice_block((6, 6, 6), 0.1, (14, 14, 14), 0.4)
    F = np.eye(3) + np.array([[0.02, 0.01, 0.0], [0.0, -0.01, 0.03], [0.0, 0.0, 0.01]])
    state = initial_state(config, position, deformation=np.broadcast_to(F, (len(position), 3, 3)))
    v = np.asarray(jit_step(config, model, state, 1e-4).velocity.T)
    depth = np.minimum(position - 0.4, 1.0 - position).min(1)
    # Its nodes reach 1.5 cells, and what those hear of reaches 1.5 cells more.
    inner = depth > 0.25
    assert inner.sum() == 8
    assert np.abs(v[~inner]).max() > 1e-3
    np.testing.assert_allclose(v[inner], 0.0, atol=1e-14)
