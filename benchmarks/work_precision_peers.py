"""The part of 'work-precision' by peers in environments of their own: Genesis and Newton.

Problems that they can state: free bodies, without body forces. The same particles, masses, moduli
and grid. Genesis takes our steps; Newton's are implicit, and as long as ours, a quarter and four
times. The ringing cube is asked of each under a law that it has, against the wave under that law;
the bars' strains are small enough (1e-3; 0.05 where only their parting is asked) that the law does
not matter.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.case import Prepared
from benchmarks.peers.remote import GENESIS, NEWTON, PEERS, Peer, Session

# Which problems, on which grids, and those that are quick.
LADDERS = {
    GENESIS.name: {
        "ringing-cube": (6, 9, 12, 18),
        "free-bar": (8, 16, 32, 64),
        "colliding-bars": (16, 32, 64),
        "particle": (50, 100, 200, 400),
    },
    # On the third grids its quarter steps take ten minutes, for errors that fall no more.
    NEWTON.name: {
        "ringing-cube": (6, 9),
        "free-bar": (8, 16),
        "colliding-bars": (16,),
    },
}
QUICK = {"ringing-cube": (6,), "free-bar": (8,)}
# How many of our steps are one of Newton's.
STRETCHES = {"newton": 1.0, "newton-quarter-steps": 0.25, "newton-long-steps": 4.0}
PATIENCE = 5.0  # seconds of a run from which on it is timed once


def built(name: str, resolution: int, peer: Peer):
    """The problem in float32, with velocities of half a step before (explicit) or of the start."""
    from jaxphys.problems.bar import Bar, free_bar
    from jaxphys.problems.catalogue import PROBLEMS
    from jaxphys.problems.ringing import Ringing, ringing

    implicit = peer is NEWTON
    more = {"staggered": not implicit, "dtype": "float32"}
    if name == "ringing-cube":
        return ringing(Ringing(hencky=implicit), resolution, **more)
    if name == "free-bar":
        return free_bar(Bar(speed=1e-2), resolution, **more)
    return PROBLEMS[name].build(resolution, "float32")


def facts(known, resolution: int, particles: int, steps: int, code: int = 0) -> dict:
    """What every line tells of a problem of the catalogue on a grid."""
    return {
        "problem": known.name,
        "resolution": resolution,
        "counts": known.resolution,
        "expected_order": known.order,
        "floor": known.floor,
        "particles": particles,
        "steps": steps,
        "code": code,
    }


def prepare(name: str, resolution: int, peer: Peer, stretch: float = 1.0) -> Prepared:
    """A peer on a problem; what is timed is its run from start to end."""
    import jax

    jax.config.update("jax_enable_x64", True)
    from benchmarks.peers.matter import told
    from jaxphys.problems.catalogue import PROBLEMS

    problem, known = built(name, resolution, peer), PROBLEMS[name]
    steps = max(1, round(problem.steps / stretch))
    matter = told(
        problem.config,
        problem.model,
        problem.state,
        dt=problem.dt * problem.steps / steps,
        steps=steps,
        spacing=problem.spacing,
    )
    session = Session(peer)
    session.load(matter)
    first, second = session.run(), session.run()

    def error() -> float:
        end = session.end()
        place = (end["position"] / problem.spacing).T
        F = np.moveaxis(end["deformation"], 0, -1)
        return known.norm(problem, problem.state._replace(position=place, deformation=F))

    return Prepared(
        session.run,
        work=float(problem.count * steps),
        compile_seconds=session.ready["seconds"] + first["seconds"] - second["seconds"],
        error=error,
        once=second["seconds"] > PATIENCE,
        extra=facts(known, resolution, problem.count, steps)
        | {
            "law": session.ready["law"],
            "peer_versions": session.ready["versions"],
            "peak_bytes": second["peak_bytes"],  # of its process
        },
    )


def left_out() -> list[tuple[str, str]]:
    """(name, why) of the peers that cannot be run here."""
    return [(peer.name, peer.missing) for peer in PEERS if peer.missing]


def methods(name: str, resolution: int, quick: bool) -> dict[str, Callable[[], Prepared]]:
    """The peers' methods for a problem on a grid, of the peers that can be run here."""
    found: dict[str, Callable[[], Prepared]] = {}
    for peer in PEERS:
        ladder = LADDERS[peer.name].get(name, ())
        if quick:
            ladder = tuple(n for n in ladder if n in QUICK.get(name, ()))
        if peer.missing or resolution not in ladder:
            continue
        stretches = STRETCHES if peer is NEWTON else {peer.name: 1.0}
        for method, stretch in stretches.items():
            if not quick or method == peer.name:
                found[method] = partial(prepare, name, resolution, peer, stretch)
    return found
