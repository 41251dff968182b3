"""Cook's membrane: a tapered panel in plane strain, clamped at its left edge, pulled up at its
right one and nearly incompressible, so that elements and particles lock.

Cook (1974), "Improved two-dimensional finite element", J. Struct. Div. ASCE 100; at these moduli de
Souza Neto, Peric, Dutko and Owen (1996), "Design of simple low order finite elements for large
strain analysis of nearly incompressible solids", Int. J. Solids Struct. 33. There is no closed
form: F-bar elements end at a rise of the upper right corner of 6.9 mm (6.891 with 30 x 30 of them),
where as many bilinear ones without it are at 4.70.

Lengths are in mm, forces in N, stresses in MPa, of a panel 1 mm thick. It comes to rest from a
damped motion under the load, whatever its density.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.mpm.boundaries import Damping, Impulse, Plane, Setting, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.loop.rollout import rollout
from jaxphys.mpm.materials.elasticity import NEO_HOOKEAN
from jaxphys.mpm.materials.law import Law
from jaxphys.mpm.state import Config, Model, State, initial_state
from jaxphys.mpm.stepping.bounds import largest_stable_dt
from jaxphys.problems.discrete import Planar

WIDTH, LEFT, RIGHT, RISE = 48.0, 44.0, 16.0, 44.0  # of the panel, its edges, the right one's foot
FORCE = 100.0
YOUNGS, POISSON = 240.565, 0.4999
TIP = 6.9
MARGIN = 4  # cells beside the panel
# The slowest swing has about the square (100 N / 6.9 mm) / a quarter of the mass, 0.2 / s.
RATE, DURATION = 0.35, 60.0


class Membrane(NamedTuple):
    """The panel on a grid, with `shape` (columns, rows) particles, columns first.

    config, model, state, dt: what `rollout` takes; steps: until it is at rest.
    """

    config: Config
    model: Model
    state: State
    dt: float
    steps: int
    shape: tuple[int, int]


def membrane(
    cells: int, law: Law = NEO_HOOKEAN, *, poisson: float = POISSON, dtype=jnp.float64
) -> Membrane:
    """The panel with `cells` of the grid along its width, and two particles a cell and axis where
    it is highest.
    """
    spacing = WIDTH / cells
    shape = 2 * cells, round(2 * LEFT / spacing)
    along, up = ((np.arange(n) + 0.5) / n for n in shape)
    s, t = np.meshgrid(along, up, indexing="ij")
    height = LEFT + (RIGHT - LEFT) * s
    start = MARGIN * spacing
    x, y = start + WIDTH * s, start + RISE * s + height * t
    position = np.stack([x, y, np.full_like(x, spacing)], axis=-1).reshape(-1, 3)
    volume = (WIDTH * height / (shape[0] * shape[1])).reshape(-1)

    top = RISE + RIGHT + TIP
    nodes = (cells + 2 * MARGIN + 1, int(np.ceil(top / spacing)) + 2 * MARGIN + 1, 3)
    grid = Grid(nodes, spacing)
    edge = 0.6 * WIDTH / shape[0]  # holds the last column
    middle, far = start + RISE + RIGHT / 2, (top, top, top)
    # A node on a plane is free: the one on the clamped edge is to be held.
    boundaries = prepare(
        (
            Plane((start + 0.25 * spacing, 0.0, 0.0), (1.0, 0.0, 0.0), "sticky"),
            Impulse(
                (start + WIDTH, middle, 0.0), (edge, *far[1:]), (0.0, FORCE, 0.0), duration=1e6
            ),
            Damping(RATE),
        ),
        Setting(grid, position, volume, np.dtype(dtype)),
    )
    full = partial(jnp.full, len(position), dtype=dtype)
    config = Config(grid, ((law, 0, len(position)),))
    model = Model(
        mass=jnp.asarray(volume, dtype),
        volume=jnp.asarray(volume, dtype),
        parameters={"youngs_modulus": full(YOUNGS), "poisson_ratio": full(poisson)},
        gravity=None,
        boundaries=(*boundaries, Planar(2)),
    )
    state = initial_state(config, position, dtype=dtype, boundaries=boundaries)
    dt = largest_stable_dt(config, model, state).dt
    return Membrane(config, model, state, float(dt), int(np.ceil(DURATION / dt)), shape)


@partial(jax.jit, static_argnums=0)
def _rollout(config, model, state, dt, steps):
    return rollout(config, model, state, dt=dt, steps=steps)


def at_rest(panel: Membrane) -> State:
    """The panel under its load; `status` says whether the steps are sound."""
    return _rollout(panel.config, panel.model, panel.state, panel.dt, panel.steps)


def tip_rise(panel: Membrane, state: State) -> float:
    """How far the upper right corner has risen [mm], half a particle beyond the last ones; infinite
    if the run failed.
    """
    if int(state.status.code):
        return float("inf")
    rise = np.asarray(state.position[1] - panel.state.position[1]).reshape(panel.shape)
    beyond = np.array([-0.5, 1.5])
    return float(beyond @ rise[-2:, -2:] @ beyond)
