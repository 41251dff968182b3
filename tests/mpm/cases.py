"""Small scenes shared by the solver's tests."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.placement import Placement
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.simulation import Simulation
from jaxphys.mpm.state import Config, Model, initial_state

# The materials that whole motions are tested with; others differ in what they do to one particle,
# which the tests of laws look at.
KINDS = ("elastic", "jelly", "metal", "sand", "fracture")


def block(count=60, shape=(9, 10, 11), dtype=jnp.float64, seed=0, law=NEO_HOOKEAN, **options):
    """A random block in motion: (config, model, state). Spacing 0.1 m; strained, spinning."""
    random = np.random.default_rng(seed)
    grid = Grid(shape, 0.1)
    position = 0.25 + 0.35 * random.random((count, 3))
    config = Config(grid, ((law, 0, count),), **options)
    model = Model(
        mass=jnp.asarray(0.1 + 0.2 * random.random(count), dtype),
        volume=jnp.asarray(1e-4 * (1 + random.random(count)), dtype),
        parameters={
            "youngs_modulus": jnp.asarray(1e3 * (1 + random.random(count)), dtype),
            "poisson_ratio": jnp.asarray(0.2 + 0.2 * random.random(count), dtype),
        },
        gravity=jnp.asarray([0.1, -0.2, -9.8], dtype),
    )
    state = initial_state(
        config,
        position,
        velocity=0.5 * random.normal(size=(count, 3)),
        deformation=np.eye(3) + 0.1 * random.normal(size=(count, 3, 3)),
        affine=random.normal(size=(count, 3, 3)),
        dtype=dtype,
    )
    return config, model, state


def long_block(count=200, cells=24, devices=1, **options):
    """A block of `cells` cells along x, sorted by it, soft and without gravity: as `block`."""
    config, model, state = block(
        count,
        (cells + 12, 10, 11),
        placement=Placement(devices, 16),
        check_step=False,
        **options,
    )
    x = 0.6 + cells * 0.1 * np.sort(np.random.default_rng(5).random(count))
    soft = {name: 0.1 * values for name, values in model.parameters.items()}
    model = replace(model, gravity=None, parameters=soft)
    return config, model, state._replace(position=state.position.at[0].set(x))


def simulation_of(config, model, state, *, dt, steps, order=None, carriers=0):
    """A simulation of one object whose first `carriers` particles carry something."""
    order = np.arange(config.particles) if order is None else order
    return Simulation(
        model,
        state,
        jnp.asarray(order, jnp.int32),
        jnp.arange(carriers, dtype=jnp.int32),
        config,
        (config.particles,),
        dt,
        steps,
    )


def public(state):
    """(x, v, C, F) with the particle axis first."""
    fields = (state.position, state.velocity, state.affine, state.deformation)
    return tuple(jnp.moveaxis(field, -1, 0) for field in fields)


def inside(equation):
    """The jaxprs that an equation holds, that of a linear map as it is run included."""
    if equation.primitive.name == "linear_map":
        run = partial(equation.primitive.impl, **equation.params)
        yield jax.make_jaxpr(run)(*(variable.aval for variable in equation.invars)).jaxpr
    for value in equation.params.values():
        for inner in value if isinstance(value, tuple | list) else (value,):
            inner = getattr(inner, "jaxpr", inner)
            if hasattr(inner, "eqns"):
                yield inner


def count_in_transfers(jaxpr, name):
    """How often a primitive occurs in the loops over the three or four planes of a stencil."""
    total = 0
    for equation in jaxpr.eqns:
        planes = equation.primitive.name == "scan" and equation.params["length"] in (3, 4)
        count = count_primitives if planes else count_in_transfers
        total += sum(count(inner, name) for inner in inside(equation))
    return total


def count_primitives(jaxpr, name):
    """How often a primitive occurs in a jaxpr, those inside others included."""
    total = 0
    for equation in jaxpr.eqns:
        total += equation.primitive.name == name
        total += sum(count_primitives(inner, name) for inner in inside(equation))
    return total
