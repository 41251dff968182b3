"""Which law was it? Each of four laws fitted to the motion of each, judged by later frames.

A wrong law may fit what it saw; what it did not see tells it from the right one. The first
frames are fitted, the last ones held out. A law's programs are compiled once.
"""

import zlib
from functools import cache, partial

import numpy as np

import jaxphys
from experiments.fitting.scenes import asked_of, fitted, moved, scene_of, solid, tracks
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Bounded, Free, Log, Problem, Stage, Tracks

FRAMES, SHOWN = 9, 6  # a 24th of a second each, and how many of them are fitted
CELLS, VELOCITY = 8, (0.3, 0.0, -1.5)
# Each law: material, its law, true numbers, and where a fit starts.
LAWS: dict[str, tuple[str, str | None, dict[str, float], dict[str, Free]]] = {
    "elastic": ("elastic", "neo-Hookean", {"youngs_modulus": 1e5},
                {"youngs_modulus": Log(4e4)}),
    "plastic": ("metal", None, {"youngs_modulus": 2e5, "yield_stress": 4e3},
                {"youngs_modulus": Log(1e5), "yield_stress": Log(1e4)}),
    "fluid": ("water", None, {"bulk_modulus": 1e5, "viscosity": 100.0},
              {"bulk_modulus": Log(5e4), "viscosity": Log(30.0)}),
    "sand": ("sand", None, {"friction_angle": 35.0, "youngs_modulus": 3e5},
             {"friction_angle": Bounded(25.0, 0.0, 80.0), "youngs_modulus": Log(2e5)}),
}  # fmt: skip


@cache
def asked(law: str, cells: int, frames: int) -> Problem:
    """The fit of a law to whatever was seen."""
    material, own, _, free = LAWS[law]
    scene = scene_of(material, {"density": 1000.0}, law=own)
    simulation, _ = jaxphys.build(scene, solid("block", cells))
    return asked_of(simulation.with_(velocity=VELOCITY), free, np.arange(frames) / 24)


def case(true: str, law: str, cells: int, frames: int, shown: int) -> Line:
    """One law fitted to the first frames of the motion of another, or of itself."""
    own = asked(true, cells, frames)
    motion = moved(own, LAWS[true][2])
    seen = tracks(motion, own.times, zlib.crc32(true.encode()))
    early = np.broadcast_to(np.arange(frames)[:, None] < shown, seen.positions.shape[:2])
    fit, evaluations = fitted(
        asked(law, cells, frames),
        Tracks(seen.positions, seen.times, seen=early, noise=seen.noise),
        # The later frames are not seen: what happens there is no wall for a trial either.
        stages=[Stage(share=share * shown / frames) for share in (0.5, 0.75, 1.0)],
    )
    off = np.asarray(fit.motion.position, np.float64)[shown:] - seen.positions[shown:]
    (misfit,) = fit.misfits
    return {
        "true": true,
        "law": law,
        "found": fit.to_json()["values"],
        "misfit": misfit.fit,
        "misfit_still": misfit.still,
        "held_out": float(np.sqrt(np.mean(off**2))),
        "held_out_still": float(
            np.sqrt(np.mean((seen.positions[shown:] - seen.positions[shown - 1]) ** 2))
        ),
        "evaluations": evaluations,
        "particles": fit.simulation.config.particles,
        "reason": fit.reason,
    }


def cases(quick: bool) -> Cases:
    """Every law on every motion; quick: two on one, coarse and short."""
    size = (5, 6, 4) if quick else (CELLS, FRAMES, SHOWN)
    motions, laws = (("elastic",), ("elastic", "fluid")) if quick else (LAWS, LAWS)
    return {f"{m} by {law}": partial(case, m, law, *size) for law in laws for m in motions}


def table(lines: list[Line]) -> str:
    """Rows are motions, columns the laws fitted to them: fit error / held-out error [mm]."""
    found = {(line["true"], line["law"]): line for line in lines if line["status"] == "ok"}
    failed = {line["case"]: line["reason"] for line in lines if line["status"] != "ok"}
    rows, right_fit, right_later, whole = [], 0, 0, 0
    for motion in dict.fromkeys(true for true, _ in found):
        tried = {law: found[motion, law] for law in LAWS if (motion, law) in found}
        by_fit = min(tried, key=lambda law: tried[law]["misfit"])
        by_later = min(tried, key=lambda law: tried[law]["held_out"])
        whole, right_fit = whole + 1, right_fit + (by_fit == motion)
        right_later += by_later == motion
        cells = []
        for law in LAWS:
            if law not in tried:
                cells.append("fails" if f"{motion} by {law}" in failed else "-")
                continue
            one = tried[law]
            text = f"{1e3 * one['misfit']:.2f} / {1e3 * one['held_out']:.2f}"
            cells.append(f"**{text}**" if law == by_later else text)
        still = tried[by_later]["held_out_still"]
        rows.append((motion, *cells, f"{1e3 * still:.1f}"))
    head = ("motion of", *(f"fitted {law}" for law in LAWS), "if it stayed as last seen")
    return markdown(head, rows) + (
        f"\n\nRight law by the fit error: {right_fit} of {whole}; by the held-out frames: "
        f"{right_later} of {whole}."
    )
