"""Problems of ours as peers are told them: in SI units, particles first."""

import numpy as np

from benchmarks.peers.protocol import Matter
from jaxphys.mpm.state import Config, Model, State


def told(
    config: Config, model: Model, state: State, *, dt: float, steps: int, spacing: float = 1.0
) -> Matter:
    """A problem of one elastic law, without boundaries.

    Args:
        dt, steps: [s], and how many of them.
        spacing: what the unit of length of state and model is worth [m].
    """

    def first(values) -> np.ndarray:
        return np.moveaxis(np.asarray(values, np.float64), -1, 0)

    ((law, _, _),) = config.segments
    pull = np.zeros(3) if model.gravity is None else np.asarray(model.gravity, np.float64)
    x, y, z = (float(g) * spacing for g in pull)
    return Matter(
        position=first(state.position) * spacing,
        velocity=first(state.velocity) * spacing,
        affine=first(state.affine),
        deformation=first(state.deformation),
        mass=first(model.mass) * spacing**3,
        volume=first(model.volume) * spacing**3,
        youngs_modulus=first(model.parameters["youngs_modulus"]) * spacing**2,
        poisson_ratio=first(model.parameters["poisson_ratio"]),
        spacing=config.grid.spacing * spacing,
        nodes=config.grid.shape,
        dt=dt,
        steps=steps,
        law=law.name,
        gravity=(x, y, z),
    )
