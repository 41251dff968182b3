"""Two examples of Newton's implicit MPM, restated: as problems here, and as Newton is told them.

`mpm_beam_twist`: an elastic beam, held at one end, whose other end turns. Newton drives particles
without mass there, which give their velocity to the nodes around them; here the same nodes turn.
`mpm_granular`: a block of sand that falls onto a box and the floor around it. Newton's sand is
rigid (E = 1e15 Pa); here it is as stiff as explicit steps can afford.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from benchmarks.peers.matter import told
from benchmarks.peers.protocol import Matter
from jaxphys.mpm.boundaries import Cuboid, Plane, Setting, Steady, prepare
from jaxphys.mpm.grid import Grid
from jaxphys.mpm.materials.elasticity import HENCKY
from jaxphys.mpm.materials.plasticity import DRUCKER_PRAGER, triaxial_friction_angle
from jaxphys.mpm.state import Config, Model, State, initial_state

DENSITY, GRAVITY = 1000.0, (0.0, 0.0, -10.0)
PER_CELL = 3  # particles along an edge of a cell
TURN = 2 * np.pi / (1000 / 240)  # of the driven end [rad/s]: once in 1000 frames
FRICTION = 0.68  # of grains on grains: |dev tau| / sqrt(2) over the pressure
MIDDLE = np.array([6.0, 6.0, 0.8])  # where sand has the example's origin: a node [m]
STIFF, RIGID = 1e6, 1e15  # Young's modulus of sand [Pa], here and Newton's


@dataclass(frozen=True)
class Example:
    """An example, for both programs.

    Attributes:
        config, model, state: for ours; size: of the body [m].
        step: Newton's [s], `steps` of which are run; law: numbers of its material that ours does
            not have; options: its settings; boundaries: as `Matter` tells them; modulus: Young's,
            where it takes another [Pa].
    """

    config: Config
    model: Model
    state: State
    size: float
    step: float
    steps: int
    law: dict[str, float]
    options: dict[str, Any]
    boundaries: list[dict[str, Any]]
    modulus: float | None = None

    @property
    def time(self) -> float:
        """Of the run [s]."""
        return self.step * self.steps

    @property
    def matter(self) -> Matter:
        """What Newton is told."""
        matter = told(self.config, self.model, self.state, dt=self.step, steps=self.steps)
        if self.modulus is not None:
            matter = replace(matter, youngs_modulus=np.full_like(matter.mass, self.modulus))
        return replace(matter, options=self.options, material=self.law, boundaries=self.boundaries)


def beam(dtype="float32", finer: int = 1, steps: int = 60, cell: float = 0.25) -> Example:
    """5 m x 1 m x 1 m of E = 5 MPa, nu = 0.45, one end held, the other turning.

    finer: cells of ours in one of the example's; steps: of 1/240 s; 1000 are the whole example.
    """
    room = 6 * cell
    counts = [round(PER_CELL * n / cell) + 1 for n in (5, 1, 1)]
    apart = np.array([5, 1, 1]) / counts
    places = _lattice(counts, apart)
    points = room + places
    held, turned = places[:, 0] < cell / 2, places[:, 0] > 5 - cell / 2
    centre = points[turned].mean(axis=0)
    # Nodes where driven particles are: a cell at each end, its inner face included.
    reach, edge = 2.0, 0.05 * cell
    half = (reach, reach, reach)
    at = (room + cell + edge - reach, centre[1], centre[2])
    to = (room + 5 - cell - edge + reach, centre[1], centre[2])
    spin = (TURN, 0.0, 0.0)
    ends = (
        Cuboid(at, half, surface="sticky"),
        Cuboid(to, half, surface="sticky", motion=Steady(spin=spin)),
    )
    nodes = tuple(round((n + 2 * room) / cell) * finer for n in (5, 1, 1))
    values = {"youngs_modulus": 5e6, "poisson_ratio": 0.45}
    config, model, state = _problem(
        HENCKY, Grid(nodes, cell / finer), points, apart, ends, dtype, values
    )
    driven = [_driven(held, centre, (0.0, 0.0, 0.0)), _driven(turned, centre, spin)]
    options = {
        "solver": "cr",
        "warmstart_mode": "particles",
        "strain_basis": "P1d",
        "velocity_basis": "Q1",
        "max_iterations": 250,
        "tolerance": 1e-6,
        "carry_residual_strain": "unconverged",
        "air_drag": 1.0,
    }
    law = {"damping": 0.001}
    return Example(config, model, state, 5.0, 1 / 240, steps, law, options, driven)


def sand(dtype="float32", finer: int = 1, steps: int = 100, cell: float = 0.2) -> Example:
    """A block of sand, 2 m wide, that falls onto a box and the floor.

    As `beam`; steps of 1/60 s, and cells of 0.1 m in the example itself.
    """
    count = round(PER_CELL * 2 / cell) + 1
    apart = np.full(3, 2 / (count - 1))
    places = _lattice([count] * 3, apart) + np.array([-1.0, -1.0, 1.5])
    places = places + (np.random.default_rng(42).random(places.shape) - 0.5) * apart
    centre, half = np.array([0.75, 0.0, 0.8]), (0.5, 2.0, 0.8)
    # Some grains of the example start within its box; they are left out.
    outside = (abs(places - centre) > half + 0.5 * apart).any(axis=1)
    points = places[outside] + MIDDLE
    x, y, z = (float(n) for n in centre + MIDDLE)
    ground = (
        Plane((0.0, 0.0, MIDDLE[2]), (0.0, 0.0, 1.0), "separate", 0.5),
        Cuboid((x, y, z), half, surface="separate", friction=0.1),
    )
    angle = triaxial_friction_angle(np.degrees(np.arcsin(FRICTION)))
    values = {"youngs_modulus": STIFF, "poisson_ratio": 0.3, "friction_angle": float(angle)}
    nodes = tuple(round(n / cell) * finer for n in (12.0, 12.0, 5.6))
    config, model, state = _problem(
        DRUCKER_PRAGER, Grid(nodes, cell / finer), points, apart, ground, dtype, values
    )
    solids = [
        {"type": "floor", "height": float(MIDDLE[2]), "friction": 0.5},
        {"type": "box", "centre": [x, y, z], "half_size": half, "friction": 0.1},
    ]
    law = {"friction": FRICTION, "yield_pressure": 1e12, "tensile_yield_ratio": 0.0}
    options = {"max_iterations": 250, "tolerance": 1e-4, "air_drag": 1.0}
    return Example(config, model, state, 2.0, 1 / 60, steps, law, options, solids, modulus=RIGID)


def _lattice(counts, apart) -> np.ndarray:
    lines = [np.arange(n) * a for n, a in zip(counts, apart, strict=True)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)


def _driven(chosen: np.ndarray, centre, spin) -> dict[str, Any]:
    return {
        "type": "driven",
        "particles": np.flatnonzero(chosen).tolist(),
        "centre": list(centre),
        "spin": list(spin),
    }


def _problem(law, grid: Grid, points, apart, boundaries, dtype, values: Mapping[str, float]):
    volume = np.full(len(points), np.prod(apart))
    made = prepare(boundaries, Setting(grid, points, volume, np.dtype(dtype)))
    config = Config(grid, ((law, 0, len(points)),), check_step=False)
    model = Model(
        mass=jnp.asarray(DENSITY * volume, dtype),
        volume=jnp.asarray(volume, dtype),
        parameters={name: jnp.full(len(points), v, dtype) for name, v in values.items()},
        gravity=jnp.asarray(GRAVITY, dtype),
        boundaries=made,
    )
    return config, model, initial_state(config, points, dtype=dtype, boundaries=made)
