"""Momentum, angular momentum and energy of a free spinning block over 100,000 fixed steps.

python -m benchmarks.extreme.conservation --out docs/benchmarks/conservation.svg

The block of the catalogue (neo-Hookean, 64 particles), strained, turning and moving, at half of its
largest stable step, in float32 and float64. What must stay is drawn as its change over its scale.
"""

import argparse
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.extreme.matter import MIDDLE, Scene, cube, scene, strained, totals
from jaxphys.mpm.loop.frames import advance_frame
from jaxphys.mpm.loop.status import check
from jaxphys.mpm.stepping.bounds import largest_stable_dt

STEPS, LOOKS = 100_000, 200


def spinning(dtype: str) -> Scene:
    """The block: it drifts by half a cell in the time drawn."""
    turn = 2.0 * np.array([[0, -1, 0.3], [1, 0, 0], [-0.3, 0, 0]])
    drift = np.array([1e-3, -5e-4, 7e-4])
    return scene(
        dtype, cube(), velocity=(cube() - MIDDLE) @ turn.T + drift, affine=turn, F=strained(0.02)
    )


def course(dtype: str, steps: int = STEPS, looks: int = LOOKS) -> list[dict]:
    """What is left of the totals every `steps / looks` steps."""
    made = spinning(dtype)
    dt = 0.5 * largest_stable_dt(made.config, made.model, made.state).limit
    each, state = steps // looks, made.state
    first = totals(made, state)
    scale = [np.linalg.norm(first[0]), np.linalg.norm(first[1]), first[2]]
    found = []
    for look in range(looks + 1):
        if look:
            dt_now, count = jnp.asarray(dt, dtype), jnp.int32(each)
            state = advance_frame(made.config, made.model, state, dt_now, count)
            check(state.status, look)
        now = totals(made, state)
        found.append(
            {
                "step": look * each,
                "dtype": dtype,
                "momentum": float(np.linalg.norm(now[0] - first[0]) / scale[0]),
                "angular momentum": float(np.linalg.norm(now[1] - first[1]) / scale[1]),
                "energy": float(now[2] / scale[2]),
            }
        )
    return found


def figure(lines: list[dict], path: Path) -> None:
    """The three courses side by side."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    names = ("momentum", "angular momentum", "energy")
    figure, axes = plt.subplots(1, 3, figsize=(10, 3), constrained_layout=True)
    for axis, name in zip(axes, names, strict=True):
        for dtype in ("float32", "float64"):
            own = [line for line in lines if line["dtype"] == dtype]
            steps = [line["step"] / 1000 for line in own]
            values = [line[name] for line in own]
            if name == "energy":
                axis.plot(steps, values, label=dtype)
            else:
                axis.semilogy(steps[1:], np.maximum(values[1:], 1e-18), label=dtype)
        axis.set_title(f"{name}, change" if name != "energy" else "energy, of the first")
        axis.set_xlabel("thousand steps")
    axes[2].set_ylim(0, 1.05)
    axes[0].legend()
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Entry point: lines beside the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--lines", type=Path, help="append raw lines here")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    lines = [line for dtype in ("float32", "float64") for line in course(dtype)]
    if options.lines:
        options.lines.write_text("".join(json.dumps(line) + "\n" for line in lines))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    figure(lines, options.out)


if __name__ == "__main__":
    main()
