"""A plain MLS-MPM step for tests: one particle's nodes at a time, arrays as they are published.

Shares no code with the solver, so that agreement means something; differentiated by jax alone.
"""

import jax
import jax.numpy as jnp


def spline(x, kernel="quadratic"):
    """B-splines by their piecewise definition."""
    x = jnp.abs(x)
    if kernel == "cubic":
        inner, outer = 2 / 3 - x**2 + x**3 / 2, (2 - x) ** 3 / 6
        return jnp.where(x < 1, inner, jnp.where(x < 2, outer, 0.0))
    return jnp.where(x < 0.5, 0.75 - x**2, jnp.where(x < 1.5, 0.5 * (1.5 - x) ** 2, 0.0))


def all_weights(grid, position, kernel="quadratic"):
    """Weights of every node of the grid for every particle, (N, nx, ny, nz): dense, no stencil."""
    lines = [
        spline(position[:, a, None] / grid.spacing - jnp.arange(grid.shape[a]), kernel)
        for a in range(3)
    ]
    return jnp.einsum("pi,pj,pk->pijk", *lines)


def nodes(grid):
    """Node positions (nx, ny, nz, 3)."""
    lines = [jnp.arange(n) * grid.spacing for n in grid.shape]
    return jnp.stack(jnp.meshgrid(*lines, indexing="ij"), axis=-1)


def to_grid(grid, position, mass, momentum, affine, kernel="quadratic"):
    """Momentum (nx, ny, nz, 3) and mass (nx, ny, nz); affine (N, 3, 3)."""
    w = all_weights(grid, position, kernel)
    d = nodes(grid)[None] - position[:, None, None, None, :]
    value = momentum[:, None, None, None, :] + jnp.einsum("pab,pijkb->pijka", affine, d)
    return jnp.einsum("pijk,pijka->ijka", w, value), jnp.einsum("pijk,p->ijk", w, mass)


def to_particle(grid, position, velocity, kernel="quadratic"):
    """Velocity (N, 3) and first moment (N, 3, 3) from node velocities (nx, ny, nz, 3)."""
    w = all_weights(grid, position, kernel)
    d = nodes(grid)[None] - position[:, None, None, None, :]
    weighted = w[..., None] * velocity[None]
    return jnp.einsum("pijka->pa", weighted), jnp.einsum("pijka,pijkb->pab", weighted, d)


def neo_hookean(E, nu, F):
    """Kirchhoff stress of one particle from the derivative of the energy, P F^T."""
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))

    def energy(F):
        J = jnp.log(jnp.linalg.det(F))
        return mu / 2 * (jnp.sum(F * F) - 3) - mu * J + lam / 2 * J**2

    return jax.grad(energy)(F) @ F.T


def per_mass(momentum, mass):
    """Velocity (nx, ny, nz, 3) of nodes, zero where there is no mass."""
    filled = mass > 1e-20 * mass.max()
    return jnp.where(filled[..., None], momentum / jnp.where(filled, mass, 1.0)[..., None], 0.0)


def step(grid, model, position, velocity, C, F, dt, kernel="quadratic", affine=1.0, blend=0.0):
    """(x, v, C, F) after a step; model: dict of mass, volume, E, nu (N,), gravity (3,).

    affine: 1 where velocity gradients are given to the grid, 0 where not; blend: share of FLIP.
    """
    stress = jax.vmap(neo_hookean)(model["E"], model["nu"], F)
    D = (3 if kernel == "cubic" else 4) / grid.spacing**2
    m, V = model["mass"], model["volume"]
    given = affine * m[:, None, None] * C
    momentum, mass = to_grid(grid, position, m, m[:, None] * velocity, given, kernel)
    force, _ = to_grid(grid, position, m, 0 * velocity, -D * V[:, None, None] * stress, kernel)
    before = per_mass(momentum, mass)
    after = per_mass(momentum + dt * force + dt * mass[..., None] * model["gravity"], mass)
    carried, B = to_particle(grid, position, after, kernel)
    old, _ = to_particle(grid, position, before, kernel)
    own = carried + blend * (velocity - old)
    return position + dt * carried, own, D * B, F + dt * D * B @ F
