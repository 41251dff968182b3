"""The catalogue's motions: matter that is stiff, heavy, thin, fast, crushed, far or broken."""

from functools import cache, partial

import numpy as np

from benchmarks.extreme.case import RIGHT, Case, Measure
from benchmarks.extreme.matter import (
    ADAPTIVE,
    COUNT,
    FIXED,
    IMPLICIT,
    MIDDLE,
    NODES,
    SPACING,
    apart,
    as_alone,
    conserved,
    cube,
    run,
    scene,
    stepped,
    strained,
)
from jaxphys.mpm.materials.elasticity import FIXED_COROTATED, HENCKY, NEO_HOOKEAN

ALONE, SIMILAR, KEPT = "closed form", "similarity", "conservation"


def _case(name, group, build, measures, by, methods=ADAPTIVE, **more) -> Case:
    if "expects" in more:
        more["expects"] = frozenset(more["expects"])
    more["build"] = build
    return Case(name, group, partial(run, build, measures), tuple(methods), by, **more)


def sound(E=1e5, nu=0.3, density=1000.0) -> float:
    """Speed of waves [m/s]."""
    return np.sqrt(E * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / density)


def lone(dtype, *, strain=0.05, **more):
    """64 particles apart from each other, strained at random."""
    return scene(dtype, apart(), **{"F": strained(strain), **more})


def block(dtype, *, E=1e5, nu=0.3, mach=0.02, **more):
    """A strained cube, whose particles move at random at a share of the speed of sound."""
    speed = mach * sound(np.max(E), np.max(nu), np.min(more.get("density", 1000.0)))
    velocity = speed * np.random.default_rng(2).normal(size=(COUNT, 3))
    given = {"F": strained(0.03), "velocity": velocity, "E": E, "nu": nu}
    return scene(dtype, more.pop("position", cube()), **{**given, **more})


# Stiffness: what E is, the motion is the same, faster by its root.


@cache
def _anchor(method: str):
    return stepped(block(method.split()[1]), method)[0].end


def _similar(found):
    """Where the block of E = 1e5 Pa has gone in as many of its own steps."""
    method = f"{'implicit' if found.implicit else 'adaptive'} {found.end.position.dtype}"
    anchor = _anchor(method)
    faster = np.sqrt(found.scene.numbers["E"][0] / 1e5)
    eps = float(np.finfo(found.end.position.dtype).eps)
    pairs = (
        ("x", found.end.position, anchor.position, SPACING),
        (
            "v",
            np.asarray(found.end.velocity, np.float64) / faster,
            anchor.velocity,
            float(np.abs(anchor.velocity).max()),
        ),
    )
    room = 1e-6 if found.implicit else 300 * eps
    return *conserved(found), *(
        Measure(name, np.abs(np.asarray(a, np.float64) - b).max() / scale, room)
        for name, a, b, scale in pairs
    )


def stiffness():
    """Young's modulus from 1e2 to 1e11 Pa."""
    for E in 10.0 ** np.arange(2, 12):
        yield _case(
            f"block E {E:.0e}",
            "stiffness",
            partial(block, E=E),
            _similar,
            SIMILAR,
            ADAPTIVE + IMPLICIT,
            quick=E in (1e2, 1e11),
        )
        yield _case(
            f"alone E {E:.0e}",
            "stiffness",
            partial(lone, E=E),
            as_alone,
            ALONE,
            quick=E in (1e2, 1e11),
        )


def poisson():
    """Poisson's ratio from -0.9 to 0.4999."""
    for nu in (-0.9, -0.5, -0.1, 0.0, 0.3, 0.45, 0.49, 0.499, 0.4999):
        ends = nu in (-0.9, 0.4999)
        # A pressure of lambda tells a strain to eps lambda / mu.
        rounding = 1 + 0.02 / (1 - 2 * nu) + 1 / (1 + nu)
        yield _case(
            f"alone nu {nu:g}",
            "poisson",
            partial(lone, nu=nu, strain=0.02),
            partial(as_alone, rounding=rounding),
            ALONE,
            quick=ends,
        )
        if nu != 0.3:
            yield _case(
                f"block nu {nu:g}",
                "poisson",
                partial(block, nu=nu),
                conserved,
                KEPT,
                ADAPTIVE + IMPLICIT,
                quick=ends,
            )


def contrasts():
    """Densities of 1e4, moduli of 1e6 and more, side by side."""
    half = np.arange(COUNT) % 2 == 0
    upper = cube()[:, 2] > MIDDLE[2]
    heavy, stiff = np.where(upper, 1e4, 1.0), np.where(upper, 1e10, 1e4)
    core = np.linalg.norm(cube() - MIDDLE, axis=1) < 0.5 * SPACING
    yield _case(
        "alone, densities 1 to 1e4",
        "contrast",
        partial(lone, density=np.where(half, 1e4, 1.0)),
        as_alone,
        ALONE,
        quick=True,
    )
    yield _case(
        "alone, moduli 1e4 to 1e10",
        "contrast",
        partial(lone, E=np.where(half, 1e10, 1e4)),
        partial(as_alone, rounding=1e3),
        ALONE,
    )
    for name, changes in {
        "heavy on light, 1e4": {"density": heavy},
        "light on heavy, 1e4": {"density": heavy[::-1]},
        "heavy core, 1e4": {"density": np.where(core, 1e4, 1.0)},
        "stiff on soft, 1e6": {"E": stiff},
        "stiff core, 1e6": {"E": np.where(core, 1e10, 1e4)},
        "stiff and light on soft and heavy": {"E": stiff, "density": heavy[::-1]},
        "rubber on cork, nu 0.4999 and -0.5": {"nu": np.where(upper, 0.4999, -0.5)},
    }.items():
        yield _case(
            name,
            "contrast",
            partial(block, mach=1e-4, **changes),
            conserved,
            KEPT,
            ADAPTIVE + IMPLICIT,
            quick=name.startswith("stiff on"),
        )


def impacts():
    """Two halves that meet at a share of the speed of sound."""
    side = np.where(np.arange(COUNT) < COUNT // 2, -1.0, 1.0)
    place = cube() + np.stack([0.08 * side, 0 * side, 0 * side], 1)
    for mach in (0.1, 0.5, 0.9):
        velocity = np.stack([-0.5 * mach * sound() * side, 0 * side, 0 * side], 1)
        build = partial(scene, position=place, velocity=velocity, bounds=40)
        yield _case(
            f"impact at Mach {mach}",
            "impact",
            build,
            conserved,
            KEPT,
            ADAPTIVE + IMPLICIT,
            quick=mach == 0.9,
        )


STIFFEST = ("fixed corotated", 20.0, 20.0)
LAWS = {"neo-Hookean": NEO_HOOKEAN, "fixed corotated": FIXED_COROTATED, "Hencky": HENCKY}


def deformations():
    """Crushed to 5 %, stretched 20 times, sheared by 5, and let go; particles apart."""
    shapes = {
        "flat to 5 %": np.diag([0.05, 1, 1]),
        "pressed to 22 % each way": np.diag([0.22, 0.22, 0.22]),
        "needle of 5 % and 20": np.diag([0.22, 0.22, 20.0]),
        "stretched 20 times": np.diag([20.0, 1, 1]),
        "swollen 20 times each way": np.diag([20.0, 20, 20]),
        "sheared by 5": np.eye(3) + 5 * np.outer([1, 0, 0], [0, 1, 0]),
        "flat to 2 % and wide": np.diag([0.02, 4, 4]),
    }
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    for law, code in LAWS.items():
        for name, F in shapes.items():
            gradients = np.einsum("ij,jk,nkl->nil", turn, F, strained(1e-3))
            far = np.max(F) >= 20
            yield _case(
                f"{name}, {law}",
                "deformation",
                # Until what is stretched 20 times is half way back; the others swing.
                partial(lone, F=gradients, law=code, time=2e-4 if far else 4e-3),
                partial(as_alone, name=law, rounding=10),
                ALONE,
                # Pressure like J^2: back through its rest before anyone has looked.
                expects={"COLLAPSED" if (law, F[2, 2], F[0, 0]) == STIFFEST else RIGHT},
                quick=law == "neo-Hookean" and F[0, 0] in (0.05, 20.0),
            )
            if far and law != "Hencky":
                # Its energy would press it to less than a thousandth on the other side.
                yield _case(
                    f"{name}, let go, {law}",
                    "deformation",
                    partial(lone, F=gradients, law=code, time=4e-3),
                    as_alone,
                    "a clear failure",
                    expects={"COLLAPSED", "STEP_TOO_LARGE"},
                    quick=law == "neo-Hookean" and F[0, 0] == 20.0,
                )
    squeeze = -2 * sound() / SPACING * np.eye(3)
    yield _case(
        "alone, squeezed at twice the speed of sound",
        "deformation",
        partial(lone, affine=squeeze, strain=1e-3),
        partial(as_alone, rounding=30),
        ALONE,
        quick=True,
    )
    yield _case(
        "the same by fixed steps",
        "deformation",
        partial(lone, affine=squeeze, strain=1e-3, fixed=0.99, bounds=40),
        partial(as_alone, rounding=30),
        ALONE,
        FIXED,
    )


def inversions():
    """Matter inside out."""
    mirror = np.broadcast_to(np.diag([1.02, 0.97, -0.9])[:, :, None], (3, 3, COUNT))
    flat = np.broadcast_to(np.diag([1.0, 1.0, 5e-4])[:, :, None], (3, 3, COUNT))
    given = np.broadcast_to(mirror[..., 0], (COUNT, 3, 3))
    every = ADAPTIVE + IMPLICIT
    yield _case(
        "given inside out",
        "inversion",
        partial(lone, F=given),
        as_alone,
        "refused",
        every,
        expects={"refused"},
        quick=True,
    )
    for name, F, code in (("inside out", mirror, "INVERTED"), ("flat", flat, "COLLAPSED")):
        build = partial(lone, replaced={"deformation": F}, time=1e-6)
        yield _case(
            f"{name} within a run",
            "inversion",
            build,
            as_alone,
            "a clear failure",
            every,
            expects={code},
            quick=True,
        )
    yield _case(
        "turned out in one step",
        "inversion",
        # At 0.2 / |C| a step is at its bound: at 5.5 times that |dt C| = 1.1.
        partial(
            lone, strain=0, affine=np.diag([0, 0, -1e4]), fixed=5.5, bounds=5.5, without_check=True
        ),
        as_alone,
        "a clear failure",
        FIXED,
        expects={"STEP_TOO_LARGE"},
    )
    yield _case(
        "nearly flat, and back",
        "inversion",
        partial(lone, F=np.diag([1, 1, 0.1]), strain=0, bounds=60),
        partial(as_alone, rounding=100),
        ALONE,
    )


def spins():
    """1e3 rad/s, of particles and of a block of steel."""
    skew = 1e3 * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0.0]])
    yield _case(
        "alone, 1e3 rad/s",
        "spin",
        partial(lone, affine=skew, E=1e7),
        partial(as_alone, rounding=10),
        ALONE,
        quick=True,
    )
    for E in (1e8, 2e11):
        build = partial(
            scene,
            position=cube(),
            velocity=(cube() - MIDDLE) @ skew.T,
            affine=skew,
            E=E,
            density=7800.0,
            bounds=200,
        )
        yield _case(
            f"block of E {E:.0e}, 1e3 rad/s",
            "spin",
            build,
            conserved,
            KEPT,
            ADAPTIVE + IMPLICIT,
            quick=E > 1e10,
        )


def shapes():
    """Sheets, threads, dust, particles on each other, on nodes, on faces, in corners."""
    i = np.arange(COUNT)
    sheet = np.stack([0.5 + 0.06 * (i % 8), 0.5 + 0.06 * (i // 8), 0.731 + 0 * i], 1)
    thread = np.stack([0.12 + 0.02 * i, 0.75 + 0 * i, 0.731 + 0 * i], 1)
    pairs = cube()[i // 2 * 2]
    for name, place in {"sheet": sheet, "thread": thread, "coincident pairs": pairs}.items():
        yield _case(
            f"a {name} of one layer" if name == "sheet" else f"{name}",
            "shape",
            partial(block, position=place),
            conserved,
            KEPT,
            ADAPTIVE + IMPLICIT,
            quick=name == "thread",
        )
    yield _case("dust", "shape", lone, as_alone, ALONE, ADAPTIVE)
    yield _case(
        "one particle with mass among 63 without",
        "shape",
        partial(lone, density=np.where(i == 17, 1000.0, 0.0)),
        partial(as_alone, who=np.array([17])),
        ALONE,
        quick=True,
    )
    F = np.broadcast_to(strained(0.1)[0], (COUNT, 3, 3))
    spots = {
        "in a cell": (0.7312, 0.7654, 0.7123), "on a node": (0.7, 0.7, 0.7),
        "on an edge of cells": (0.7, 0.7, 0.7333), "on a face": (0.7, 0.7222, 0.7333),
        "where its nodes change": (0.75, 0.75, 0.75),
        "in a corner of the domain": (0.0501, 0.0501, 0.0501),
        "in the far corner": (1.4499, 1.4499, 1.4499),
    }  # fmt: skip
    for name, spot in spots.items():
        build = partial(scene, position=np.tile(spot, (COUNT, 1)), F=F, velocity=None)
        yield _case(
            f"64 coincident {name}",
            "place",
            build,
            as_alone,
            ALONE,
            quick=name in ("on a node", "where its nodes change"),
        )
    pushed = np.where(i % 2 == 0, 1.0, -1.0)[:, None] * np.array([1.0, 0.5, 0])
    yield _case(
        "64 coincident, half of them the other way",
        "place",
        partial(scene, position=np.tile((0.73, 0.74, 0.75), (COUNT, 1)), velocity=pushed),
        _stopped,
        "momentum",
        quick=True,
    )
    two = np.where(i < COUNT // 2, 0.2, 1.2)[:, None] * [1, 0, 0] + [0, 0.73, 0.77]
    yield _case(
        "two heaps, an empty gap of 8 cells",
        "place",
        partial(scene, position=two, F=F),
        as_alone,
        ALONE,
        quick=True,
    )
    for name, place, speed in (
        ("outside from the start", (1.6, 0.7, 0.7), 0.0),
        ("thrown out", (1.40, 0.7, 0.7), 1.0),
    ):
        build = partial(
            scene, position=np.tile(place, (COUNT, 1)), velocity=(speed, 0, 0), time=0.2
        )
        yield _case(
            name, "place", build, as_alone, "a clear failure", expects={"LEFT_GRID"}, quick=True
        )


def _stopped(found):
    eps = float(np.finfo(found.end.position.dtype).eps)
    return (Measure("v", np.abs(np.asarray(found.end.velocity)).max(), 100 * eps),)


def grids():
    """Grids of 8 to 256 cells, and places far from the origin."""
    F = np.broadcast_to(strained(0.1)[0], (COUNT, 3, 3))
    for cells in (8, 32, 64, 128, 256):
        build = partial(
            scene,
            F=F,
            nodes=(cells + 1,) * 3,
            window=True,
            velocity=(0.1, 0.2, 0.3),
            position=np.tile(0.6 * cells * SPACING * np.array([1, 0.9, 0.8]), (COUNT, 1)),
        )
        yield _case(
            f"a grid of {cells} cells a side",
            "grid",
            build,
            as_alone,
            ALONE,
            quick=cells == 8,
        )
    for cells in (1_000, 10_000):
        build = partial(
            scene,
            F=F,
            nodes=(cells + 1, NODES, NODES),
            window=True,
            velocity=(0.3, 0, 0),
            position=np.tile([0.99 * cells * SPACING, 0.73, 0.77], (COUNT, 1)),
        )
        yield _case(
            f"{cells} cells from the origin",
            "grid",
            build,
            as_alone,
            ALONE,
            quick=cells == 10_000,
        )


def long_flights():
    """Steps without end: x + v t to rounding."""
    for steps in (1_000, 100_000):
        build = partial(
            scene,
            position=cube(),
            velocity=np.array([40, -30, 20]) / steps,
            fixed=0.5,
            bounds=steps / 2,
            E=1e5,
        )
        yield _case(
            f"free flight of {steps} steps",
            "steps",
            build,
            partial(_flown, steps=steps),
            ALONE,
            FIXED,
            quick=steps == 1_000,
        )


def _flown(found, steps: int):
    eps = float(np.finfo(found.end.position.dtype).eps)
    numbers, span = found.scene.numbers, float(found.lengths[0]) * len(found.lengths)
    end = np.asarray(found.end.position, np.float64).T
    if found.end.residual is not None:
        end = end + np.asarray(found.end.residual.position, np.float64).T
    way = np.linalg.norm(numbers["velocity"][0]) * span
    off = np.abs(end - numbers["position"] - numbers["velocity"] * span).max()
    turned = np.abs(np.moveaxis(np.asarray(found.end.deformation), -1, 0) - np.eye(3)).max()
    return (
        # In float64 nothing is carried over, and a step is rounded as the place is.
        Measure("x", off / way, 3 * eps * (steps**0.5 + steps * (eps < 1e-10) / way)),
        Measure("F", turned, 3 * eps * steps**0.5),
        Measure("momentum", conserved(found)[0].value, 3 * eps * steps),
    )


def steps():
    """Fixed steps below, at and above what is stable."""
    for share in (0.5, 0.99):
        yield _case(
            f"fixed steps at {share} of the bound",
            "steps",
            partial(lone, strain=1e-4, fixed=share, bounds=100),
            as_alone,
            ALONE,
            FIXED,
            quick=True,
        )
        yield _case(
            f"a block by fixed steps at {share} of the bound",
            "steps",
            partial(block, fixed=share, bounds=100),
            conserved,
            KEPT,
            FIXED,
        )
    yield _case(
        "fixed steps at 1.5 of the bound",
        "steps",
        partial(lone, strain=1e-4, fixed=1.5, bounds=100),
        as_alone,
        "a clear failure",
        FIXED,
        expects={"UNSTABLE_STEP"},
        quick=True,
    )


def expansion():
    """A cloud without strength that flies apart until all its particles are alone."""
    rate, place = 100.0, cube(0.4)
    build = partial(
        scene,
        position=place,
        E=1e-6,
        velocity=rate * (place - MIDDLE),
        affine=rate * np.eye(3),
        time=9 / rate,
    )
    yield _case("flown apart to ten times its size", "deformation", build, conserved, KEPT)


def controls():
    """What must come out wrong: broken laws, an unguarded step, a shifted answer."""
    from dataclasses import replace

    def stronger(parameters, F, history, dt):
        F, tau, history = NEO_HOOKEAN.update(parameters, F, history, dt)
        return F, 1.001 * tau, history

    def twisted(parameters, F, history, dt):
        F, tau, history = NEO_HOOKEAN.update(parameters, F, history, dt)
        return F, tau.at[0, 1].add(0.01 * tau[0, 0]), history

    wrong = {"wrong"}
    yield _case(
        "control: a law 0.1 % too strong",
        "control",
        partial(lone, law=replace(NEO_HOOKEAN, update=stronger)),
        as_alone,
        ALONE,
        expects=wrong,
        quick=True,
    )
    yield _case(
        "control: a law whose stress is not symmetric",
        "control",
        partial(block, law=replace(NEO_HOOKEAN, update=twisted)),
        conserved,
        KEPT,
        expects=wrong,
    )
    yield _case(
        "control: steps at 1.5 of the bound, unguarded",
        "control",
        partial(lone, strain=1e-4, fixed=1.5, bounds=15, without_check=True),
        conserved,
        KEPT,
        FIXED,
        expects=wrong | {"STEP_TOO_LARGE", "INVERTED"},
    )
    yield _case(
        "control: 63 particles told as 64",
        "control",
        partial(lone, density=np.where(np.arange(COUNT) == 5, 1001.0, 1000.0)),
        partial(_forgetting),
        ALONE,
        expects=wrong,
        quick=True,
    )


def _forgetting(found):
    """Against a reference that has one density wrong by a thousandth."""
    numbers = found.scene.numbers | {"density": np.full(COUNT, 1000.0)}
    return as_alone(found._replace(scene=found.scene._replace(numbers=numbers)))


def cases() -> list[Case]:
    """All of them."""
    parts = (
        stiffness, poisson, contrasts, impacts, deformations, expansion, inversions, spins, shapes,
        grids, steps, long_flights, controls,
    )  # fmt: skip
    return [case for part in parts for case in part()]
