"""Energy of matter, for curves."""

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from jaxphys.mpm.state import Config, Model, State


@partial(jax.jit, static_argnames="config")
def energies(config: Config, model: Model, state: State) -> dict[str, Array]:
    """Kinetic, elastic and gravity's energy [J], () each. Elastic energy is that of laws which
    have one; gravity's is zero at the origin.
    """
    mass, position = model.mass, state.position
    squares = jnp.sum(state.velocity**2, axis=0)
    if config.transfer.scheme.affine:  # motion about a particle's own middle
        squares = squares + jnp.sum(state.affine**2, axis=(0, 1)) / config.kernel.inverse_inertia
    kinetic = 0.5 * jnp.sum(mass * squares)
    stored = jnp.zeros((), mass.dtype)
    for law, start, stop in config.segments:
        if law.energy is None:
            continue
        values = {name: model.parameters[name][start:stop] for name in law.parameters}
        history = law.at_start(model.volume[start:stop])
        if state.history is not None:
            history = state.history[: len(law.history), start:stop]
        density = law.energy(values, state.deformation[..., start:stop], history)
        stored = stored + jnp.sum(model.volume[start:stop] * density)
    height = jnp.zeros((), mass.dtype)
    if model.gravity is not None:
        height = -jnp.sum(mass * jnp.einsum("i,in->n", model.gravity, position))
    return {"kinetic": kinetic, "elastic": stored, "gravity": height}
