"""The catalogue's scenes that peers can state, and what they come to there.

A peer is held to what any solver owes: where the middle goes, momentum, angular momentum, no energy
out of nothing, the same motion at any stiffness, a rigid turn that stays one, and (of particles
alone, for Genesis takes this solver's very steps) the closed form. All within a percent or so, not
to rounding: this tells what is sound, `work-precision` tells how accurate. Our own run is held to
the same. Outcomes are `right`, `error` (an exception that says something), `NaN` (numbers that are
none, and nothing said) and `wrong` (numbers out of tolerance, and nothing said).
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.extreme import motion
from benchmarks.extreme.case import RIGHT, WRONG, Case, Cell, Measure, judged, line_of
from benchmarks.extreme.lone import STRESSES, lame, march
from benchmarks.extreme.matter import NAMES, SPACING, stepped
from benchmarks.peers.protocol import ENDS, Matter
from benchmarks.peers.remote import NEWTON, PEERS, PeerError, Session

OURS = "jaxphys"
ERROR, NAN = "error", "NaN"
EXPLICIT, IMPLICIT = 0.5, 4.0  # steps, in units of the largest stable explicit one
PERCENT = 0.01
SWING = 0.1  # what leapfrog steps add to an energy and take again
ANCHOR = "block E 1e+05"
# The catalogue's names, by what of them is asked; Hencky's law is Newton's, others Genesis's.
LOOSE = [
    *(f"block nu {nu}" for nu in ("-0.9", "-0.5", "0", "0.45", "0.49", "0.499", "0.4999")),
    "heavy on light, 1e4",
    "heavy core, 1e4",
    "stiff on soft, 1e6",
    "stiff core, 1e6",
    "stiff and light on soft and heavy",
    "rubber on cork, nu 0.4999 and -0.5",
    *(f"impact at Mach {mach}" for mach in (0.1, 0.5, 0.9)),
    "inside out within a run",
    "flat within a run",
    "a sheet of one layer",
    "thread",
    "coincident pairs",
    "outside from the start",
    "thrown out",
    "one particle with mass among 63 without",
    "block of E 1e+08, 1e3 rad/s",
]
SIMILAR = [f"block E {E:.0e}" for E in 10.0 ** np.arange(2, 12)]
TURNING = ["block of E 2e+11, 1e3 rad/s"]  # the softer one grows by its spin
SHAPES = ("flat to 5 %", "pressed to 22 % each way", "stretched 20 times", "sheared by 5")
ALONE = [
    *(f"{shape}, {law}" for law in ("neo-Hookean", "fixed corotated") for shape in SHAPES),
    "stretched 20 times, let go, neo-Hookean",
    "nearly flat, and back",
    "fixed steps at 1.5 of the bound",
]
BY_HENCKY = [f"{shape}, Hencky" for shape in SHAPES]


class Ran(NamedTuple):
    """A run: what was asked, and position, velocity, affine and deformation at its end."""

    matter: Matter
    end: dict[str, np.ndarray]


def asked(case: Case, implicit: bool) -> Matter:
    """A case as a peer is told it."""
    from benchmarks.peers.matter import told
    from jaxphys.core.errors import InputError
    from jaxphys.mpm.stepping.bounds import largest_stable_dt

    assert case.build is not None
    made = case.build("float32")
    try:
        stable = float(largest_stable_dt(made.config, made.model, made.state).limit)
    except InputError:  # no bound of what is inside out
        stable = made.time
    duration = made.time or made.bounds * stable
    share = IMPLICIT if implicit else max(EXPLICIT, made.fixed)
    steps = max(1, round(duration / (share * stable)))
    return told(made.config, made.model, made.state, dt=duration / steps, steps=steps)


def ours(case: Case) -> Ran:
    """A run by our adaptive steps, or by fixed ones where the case is about them.

    Raises:
        PeerError: it ended in a failure, by name.
    """
    assert case.build is not None
    (method,) = (one for one in case.methods if one.endswith("float32"))
    end = stepped(case.build("float32"), method)[0].end
    if int(end.status.code):
        raise PeerError(NAMES[int(end.status.code)])
    values = {n: np.moveaxis(np.asarray(getattr(end, n), np.float64), -1, 0) for n in ENDS}
    return Ran(asked(case, implicit=False), values)


# What is measured.


def stored(law: str, matter: Matter, F: np.ndarray) -> np.ndarray:
    """Energy density (N,) [Pa]; not a number inside out, where the laws have none."""
    mu, lam = lame(matter.youngs_modulus, matter.poisson_ratio)
    J = np.linalg.det(F)
    stretches = np.linalg.svd(F, compute_uv=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        if law == "Hencky":
            e = np.log(stretches)
            return mu * np.sum(e**2, axis=1) + 0.5 * lam * np.sum(e, axis=1) ** 2
        if law == "fixed corotated":
            return mu * np.sum((stretches - 1) ** 2, axis=1) + 0.5 * lam * (J - 1) ** 2
        squares = np.sum(stretches**2, axis=1)
        return mu * (0.5 * (squares - 3) - np.log(J)) + 0.5 * lam * np.log(J) ** 2


def totals(run: Ran, state: dict[str, np.ndarray], method: str):
    """Momentum, angular momentum about the middle, kinetic and stored energy."""
    mass = run.matter.mass
    x, v, C, F = (state[name] for name in ENDS)
    x = x - mass @ x / mass.sum()
    if method == NEWTON.name:  # trilinear weights: the moment depends on the place in the cell
        inside = state["position"] / SPACING % 1
        moments = SPACING**2 * inside * (1 - inside)
        law = "Hencky"
    else:
        moments = np.full_like(x, SPACING**2 / 4)
        law = run.matter.law
    spread = C * moments[:, None, :]
    spin = [spread[:, 2, 1] - spread[:, 1, 2], spread[:, 0, 2] - spread[:, 2, 0]]
    spin = np.stack([*spin, spread[:, 1, 0] - spread[:, 0, 1]], axis=1)
    turning = mass @ (np.cross(x, v) + spin)
    moving = 0.5 * (mass @ np.sum(v**2, axis=1) + mass @ np.sum(C * spread, axis=(1, 2)))
    return mass @ v, turning, moving, run.matter.volume @ stored(law, run.matter, F)


def owed(run: Ran, method: str) -> tuple[Measure, ...]:
    """The middle's way, momenta, and energy."""
    matter, mass = run.matter, run.matter.mass
    start = {name: getattr(matter, name) for name in ENDS}
    p, L, kinetic, strain = totals(run, start, method)
    p_end, L_end, kinetic_end, strain_end = totals(run, run.end, method)
    energy, energy_end = kinetic + strain, kinetic_end + strain_end
    speed = np.sqrt(2 * max(energy, kinetic_end) / mass.sum()) or 1.0
    time = matter.dt * matter.steps
    way = mass @ (run.end["position"] - matter.position) / mass.sum() - p / mass.sum() * time
    gained = (energy_end - energy) / energy if energy else energy_end
    return (
        Measure("middle", np.abs(way).max() / SPACING, PERCENT),
        Measure("momentum", np.abs(p_end - p).max() / (mass.sum() * speed), PERCENT),
        Measure("angular momentum", np.abs(L_end - L).max() / (mass.sum() * speed * SPACING), 0.05),
        Measure("energy gained", max(gained, 0.0) if np.isfinite(gained) else np.inf, SWING),
    )


def similar(run: Ran, anchor: Ran) -> tuple[Measure, ...]:
    """Positions and velocities against those of E = 1e5 Pa, faster by the root."""
    faster = np.sqrt(run.matter.youngs_modulus[0] / anchor.matter.youngs_modulus[0])
    speed = np.abs(anchor.end["velocity"]).max()
    x = np.abs(run.end["position"] - anchor.end["position"]).max() / SPACING
    v = np.abs(run.end["velocity"] / faster - anchor.end["velocity"]).max() / speed
    return Measure("x", x, PERCENT), Measure("v", v, PERCENT)


def turned(run: Ran) -> tuple[Measure, ...]:
    """Places against those of a rigid turn about z, at 1e3 rad/s."""
    matter = run.matter
    angle = 1e3 * matter.dt * matter.steps
    cos, sin = np.cos(angle), np.sin(angle)
    middle = matter.position.mean(axis=0)
    exact = (matter.position - middle) @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    off = np.abs(run.end["position"] - middle - exact).max()
    return (Measure("rigid turn", off / SPACING, 5 * PERCENT),)


def marched(run: Ran) -> tuple[Measure, ...]:
    """F against a particle alone, by the same steps."""
    matter = run.matter
    own = {"E": matter.youngs_modulus, "nu": matter.poisson_ratio}
    F, _ = march(
        STRESSES[matter.law],
        matter.deformation,
        matter.affine,
        np.full(matter.steps, matter.dt),
        density=matter.mass / matter.volume,
        spacing=matter.spacing,
        **own,
    )
    off = np.abs(run.end["deformation"] - F).max() / np.abs(F).max()
    return (Measure("F", off, PERCENT),)


class Column:
    """Judges cases by one method; what an E of 1e5 Pa does is run once."""

    def __init__(self, method: str, cases: dict[str, Case]):
        self.method, self._cases = method, cases
        self._anchor: Ran | None = None
        self._session: Session | None = None

    def ran(self, name: str) -> Ran:
        """A run of a case.

        Raises:
            PeerError: it ended in an error.
        """
        case = self._cases[name]
        if self.method == OURS:
            return ours(case)
        (peer,) = (peer for peer in PEERS if peer.name == self.method)
        matter = asked(case, implicit=peer is NEWTON)
        if self._session is None or not self._session.alive:
            self.close()
            self._session = Session(peer)
        self._session.load(matter)
        self._session.run()
        return Ran(matter, self._session.end())

    def close(self) -> None:
        """Ends the peer's process."""
        if self._session is not None:
            self._session.close()

    def cell(self, name: str) -> Cell:
        """What came of a case."""
        try:
            run = self.ran(name)
        except PeerError as error:
            return Cell(ERROR, message=str(error))
        more = {"steps": run.matter.steps} if self.method != OURS else {}
        if not all(np.isfinite(value).all() for value in run.end.values()):
            return Cell(NAN, message="not finite, and nothing says so", **more)
        measures = owed(run, self.method)
        if name in SIMILAR:
            if self._anchor is None:
                self._anchor = self.ran(ANCHOR)
            measures += similar(run, self._anchor)
        if name in TURNING:
            measures += turned(run)
        if name in ALONE and self.method != OURS:  # ours is held to its own steps in the catalogue
            measures = measures[:3] + marched(run)
        return judged(measures, **more)


def methods(name: str) -> tuple[str, ...]:
    """Who can state a case."""
    if name in ALONE:
        return OURS, "genesis"
    if name in BY_HENCKY:
        return OURS, "newton"
    return OURS, "genesis", "newton"


def lines(quick: bool) -> Iterator[dict]:
    """A line for every peer that is missing, then one for each case and method."""
    import jax

    jax.config.update("jax_enable_x64", True)
    for peer in PEERS:
        if peer.missing:
            yield {
                "suite": "extreme-peers",
                "case": "peers",
                "method": peer.name,
                "status": peer.missing,
            }
    here = [OURS, *(peer.name for peer in PEERS if not peer.missing)]
    if here == [OURS]:
        return
    cases = {case.name: case for case in motion.cases()}
    columns = {method: Column(method, cases) for method in here}
    try:
        for name in [*SIMILAR, *LOOSE, *TURNING, *ALONE, *BY_HENCKY]:
            case = cases[name]
            for method in methods(name):
                if method in columns and (case.quick or not quick):
                    yield line(case, method, columns[method])
    finally:
        for column in columns.values():
            column.close()


def line(case: Case, method: str, column: Column) -> dict:
    """A line: nothing is expected of a peer, so that no outcome of it is unexpected."""
    asked_of = Case(case.name, case.group, lambda _: column.cell(case.name), (method,), case.by)
    found = line_of(asked_of, method) | {"suite": "extreme-peers", "status": "ok"}
    del found["expects"], found["largest_stable_dt"]
    assert found["outcome"] in (RIGHT, WRONG, ERROR, NAN)
    return found
