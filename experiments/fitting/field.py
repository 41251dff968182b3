"""A stiff and a soft half, found from tracks as a field of stiffness on a coarse grid.

    python -m experiments.fitting field --out benchmarks/lines/fitting-field.jsonl

A block falls; nobody says where it is stiff. `draw` makes the picture of truth, fit and error.
"""

from functools import partial
from pathlib import Path

import jax
import numpy as np

import jaxphys
from experiments.fitting.published import TIMES
from experiments.fitting.scenes import STEPS, asked_of, fitted, scene_of, solid, tracks
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import LBFGS, Field, Log, motion_at

SOFT, STIFF, START = 3e4, 3e5, 1e5
NODES = (5, 2, 2)


def case(cells: int, times: np.ndarray) -> Line:
    """The fit; the middle of the block along x divides it."""
    scene = scene_of("elastic", {"density": 1000.0, "poisson_ratio": 0.3}, law="neo-Hookean")
    simulation, _ = jaxphys.build(scene, solid("block", cells))
    simulation = simulation.with_(velocity=(0.0, 0.0, -2.0))
    rest = np.asarray(simulation.frame(simulation.state).position, np.float64)
    middle = 0.5 * (rest[:, 0].min() + rest[:, 0].max())
    true = np.where(rest[:, 0] < middle, SOFT, STIFF)
    free = {"youngs_modulus": Field(Log(START), nodes=NODES)}
    asked = asked_of(simulation, free, times)
    run = jax.jit(partial(motion_at, times=asked.times, steps=STEPS))
    motion = jax.device_get(run(simulation.with_(youngs_modulus=true))).check()
    seen = tracks(motion, asked.times, 1)
    fit, evaluations = fitted(asked, seen, search=LBFGS(iterations=40))
    entry_nodes = free["youngs_modulus"].weights(rest)
    line = np.log10(np.asarray(fit.values["youngs_modulus"]))
    found = np.sum(line[entry_nodes[0]] * entry_nodes[1], axis=0)
    error = found - np.log10(true)
    halves = {
        name: {
            "true": value,
            "found": float(10 ** np.median(found[true == value])),
            "rms_decades": float(np.sqrt(np.mean(error[true == value] ** 2))),
        }
        for name, value in (("soft", SOFT), ("stiff", STIFF))
    }
    (misfit,) = fit.misfits
    return {
        "halves": halves,
        "nodes": NODES,
        "node_values": [round(float(v), 3) for v in line],
        "rms_decades": float(np.sqrt(np.mean(error**2))),
        "start_rms_decades": float(np.sqrt(np.mean((np.log10(START / true)) ** 2))),
        "misfit": misfit.fit,
        "misfit_start": misfit.start,
        "misfit_still": misfit.still,
        "noise": misfit.noise,
        "evaluations": evaluations,
        "reason": fit.reason,
        "particles": len(rest),
        "x": np.round(rest[:, 0], 3).tolist(),
        "z": np.round(rest[:, 2], 3).tolist(),
        "decades": np.round(found, 3).tolist(),
    }


def cases(quick: bool) -> Cases:
    """The one."""
    size = (6, TIMES[:5]) if quick else (10, TIMES)
    return {"two halves": partial(case, *size)}


def draw(line: Line, path: Path) -> None:
    """Truth, fit and error of each particle from the side, in decades."""
    import matplotlib.pyplot as plt

    x, z, found = (np.array(line[name]) for name in ("x", "z", "decades"))
    soft, stiff = (np.log10(line["halves"][name]["true"]) for name in ("soft", "stiff"))
    true = np.where(x < 0.5 * (x.min() + x.max()), soft, stiff)
    figure, axes = plt.subplots(1, 3, figsize=(9, 2.8), layout="constrained")
    shown = (("truth", true, "viridis", soft, stiff), ("fit", found, "viridis", soft, stiff),
             ("error", found - true, "coolwarm", -0.5, 0.5))  # fmt: skip
    for axis, (title, values, colours, low, high) in zip(axes, shown, strict=True):
        marks = axis.scatter(x, z, c=values, s=45, cmap=colours, vmin=low, vmax=high, marker="s")
        axis.set(title=title, aspect="equal", xlabel="x [m]")
        figure.colorbar(marks, ax=axis, label="decades" if title == "error" else "log10 E [Pa]")
    axes[0].set_ylabel("z [m]")
    figure.savefig(path, dpi=90)
    plt.close(figure)


def table(lines: list[Line]) -> str:
    """A row for each half."""
    (line,) = lines
    rows = [
        (name, f"{half['true']:.3g}", f"{START:.3g}", f"{half['found']:.3g}",
         f"{half['rms_decades']:.3f}")
        for name, half in line["halves"].items()
    ]  # fmt: skip
    head = ("half", "true E [Pa]", "start", "found, median", "rms error [decades]")
    return markdown(head, rows) + (
        f"\n\nOver all particles {line['rms_decades']:.3f} decades, "
        f"{line['start_rms_decades']:.3f} at the start; "
        f"misfit {line['misfit']:.2e} m where the noise is {line['noise']:.0e} and "
        f"nothing that moves gives {line['misfit_still']:.2e}; {line['evaluations']} evaluations, "
        f"{line['particles']} particles, {line['cpu_seconds']:.0f} CPU seconds "
        f"({line['processor']})."
    )
