"""What a peer in an environment of its own is asked, and what it answers; numpy and nothing else.

A problem goes over as one .npz, the motion's end comes back as another. The peer's process stays
alive, so that compiling is told apart from running: it answers the lines `load PROBLEM.npz` and
`run`, which starts anew from the problem's start, by one line of JSON each, on a pipe of its own,
since peers print what they like.
"""

import json
import os
import platform
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

ENDS = ("position", "velocity", "affine", "deformation")
TEXTS = ("options", "material", "boundaries")  # fields that go over as JSON


@dataclass(frozen=True)
class Matter:
    """Particles of elastic matter on a grid of nodes at whole multiples of `spacing`, SI units.

    Attributes:
        position, velocity: (N, 3) [m], [m/s]; affine: (N, 3, 3) [1/s]; deformation: (N, 3, 3), as
            they are at the start; of explicit steps, velocities are those of half a step before.
        mass, volume, youngs_modulus, poisson_ratio: (N,) [kg], [m^3], [Pa], [1].
        spacing: of nodes [m]; nodes: (3,) how many, from the origin on.
        dt, steps: [s], and how many of them.
        law: "neo-Hookean", "fixed corotated" or "Hencky": what a peer that has another must tell.
        gravity: (3,) [m/s^2].
        options: settings of the peer's own, by name.
        material: numbers of the peer's own law, by name, the same for all particles.
        boundaries: each a dict: `floor` (height, friction), `box` (centre, half_size, friction) or
            `driven`: particles, by index, that turn about centre with a spin (3,) [rad/s].
    """

    position: np.ndarray
    velocity: np.ndarray
    affine: np.ndarray
    deformation: np.ndarray
    mass: np.ndarray
    volume: np.ndarray
    youngs_modulus: np.ndarray
    poisson_ratio: np.ndarray
    spacing: float
    nodes: tuple[int, int, int]
    dt: float
    steps: int
    law: str = "neo-Hookean"
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    options: dict[str, Any] = field(default_factory=dict)
    material: dict[str, float] = field(default_factory=dict)
    boundaries: list[dict[str, Any]] = field(default_factory=list)

    def save(self, path: Path) -> None:
        """Writes the problem as .npz."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        texts = {name: json.dumps(values[name]) for name in TEXTS}
        np.savez(path, **(values | texts))

    @classmethod
    def load(cls, path: Path) -> "Matter":
        """Reads what `save` wrote."""
        with np.load(path) as saved:
            values = {name: saved[name] for name in saved.files}
        plain = {
            "spacing": float(values["spacing"]),
            "nodes": tuple(int(n) for n in values["nodes"]),
            "dt": float(values["dt"]),
            "steps": int(values["steps"]),
            "law": str(values["law"]),
            "gravity": tuple(float(g) for g in values["gravity"]),
        }
        return cls(**(values | plain | {name: json.loads(str(values[name])) for name in TEXTS}))


def turning(
    told: dict[str, Any], start: np.ndarray, time: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Driven particles at a time [s]: places [m] and velocities [m/s], (N, 3), and the gradient of
    velocity [1/s], (3, 3). start: (N, 3) [m]; told: as `Matter.boundaries` has it.
    """
    centre, spin = np.asarray(told["centre"]), np.asarray(told["spin"])
    across = np.cross(spin, np.eye(3)).T  # times an arm: spin x arm
    speed = np.linalg.norm(spin)
    turn = np.eye(3)
    if speed:  # Rodrigues' formula
        axis, angle = across / speed, speed * time
        turn = turn + np.sin(angle) * axis + (1 - np.cos(angle)) * axis @ axis
    arm = (start - centre) @ turn.T
    return centre + arm, arm @ across.T, across


@dataclass(frozen=True)
class Simulation:
    """A problem in a peer's own terms.

    Attributes:
        reset: back to the start; advance: runs all steps and returns when they are done.
        end: () -> position, velocity, affine and deformation, as in `Matter`.
        steps: how many steps `advance` takes; law: what it takes for the law.
        versions: of the peer and of what it stands on.
    """

    reset: Callable[[], None]
    advance: Callable[[], None]
    end: Callable[[], tuple[np.ndarray, ...]]
    steps: int
    law: str
    versions: dict[str, str]


def serve(build: Callable[[Matter], Simulation]) -> None:
    """A peer's whole process: python -m MODULE END.npz PIPE, the number of the pipe that answers go
    to. An exception of the peer's is an answer, after which it can be asked again.
    """
    end, answers = Path(sys.argv[1]), os.fdopen(int(sys.argv[2]), "w")
    current: list[Simulation] = []
    for line in sys.stdin:
        command, _, path = line.strip().partition(" ")
        try:
            if command == "load":
                answer = _loaded(build, Path(path), current)
            elif command == "run" and current:
                answer = _ran(current[0], end)
            else:
                answer = {"status": "error", "kind": "protocol", "message": line.strip()}
        except Exception as error:  # whatever a peer says is its outcome
            text = " ".join(str(error).split())[:500]
            answer = {"status": "error", "kind": type(error).__name__, "message": text}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _loaded(build: Callable[[Matter], Simulation], path: Path, current: list[Simulation]) -> dict:
    current.clear()
    start = time.perf_counter()
    current.append(build(Matter.load(path)))
    return {
        "status": "ready",
        "seconds": time.perf_counter() - start,
        "steps": current[0].steps,
        "law": current[0].law,
        "versions": {"python": platform.python_version(), **current[0].versions},
    }


def _ran(simulation: Simulation, end: Path) -> dict:
    simulation.reset()
    start = time.perf_counter()
    simulation.advance()
    seconds = time.perf_counter() - start
    np.savez(end, **dict(zip(ENDS, simulation.end(), strict=True)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return {"status": "ok", "seconds": seconds, "peak_bytes": peak}
