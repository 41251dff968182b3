"""Can a prior of single pictures tell how stiff something is from how it moves?

    python -m experiments.fitting guided --out benchmarks/lines/fitting-guided.jsonl

A ball falls; each stiffness makes a clip, and the bundled image prior, told "a red ball", is asked
about its frames. Score distillation (Poole et al. 2023) pushes on the logarithm of the stiffness
by the mean of g . dx / d log E over frames and noise, g its gradient of the pictures x, whose
derivative is here a difference of neighbouring stiffnesses. What it pushes against is the loss: the
force, integrated. A prior that can guide has a least loss at some stiffness between the ends, and
the same one for other draws of noise.
"""

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import jaxphys
from experiments.fitting.scenes import CAPACITY, SIZE, asked_of, moved, scene_of, solid
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Log
from jaxphys.gaussians import from_points
from jaxphys.guidance.bundled.pixel_guide import bundled_image_guide
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.views import DISTANCE, FIELD_OF_VIEW, RESOLUTION, camera_position
from jaxphys.render import look_at

PROMPT, RED = "a red ball", (0.8, 0.1, 0.1)
TIMES = np.arange(1, 8) / 24
STIFFNESSES = np.logspace(3.5, 6, 11)
VELOCITY = (0.0, 0.0, -1.5)
AZIMUTH, ELEVATION = 0.4, 0.2
DRAWS = 8  # of noise, of each frame


def pictures(look, motion) -> np.ndarray:
    """Frames (T, R, R, 3) by a camera that follows the middle, as the prior learned to see."""
    draw = jax.jit(partial(jaxphys.draw, background=0.5, capacity=CAPACITY))
    away = camera_position(AZIMUTH, ELEVATION, DISTANCE * SIZE)
    made = []
    for t in range(len(motion)):
        middle = np.mean(motion.position[t], axis=0)
        camera = look_at(
            tuple(middle + away), tuple(middle), field_of_view=FIELD_OF_VIEW,
            width=RESOLUTION, height=RESOLUTION,
        )  # fmt: skip
        made.append(draw(look, motion[t], camera).colour)
    return np.asarray(made)


def forces(clips: np.ndarray, decades: np.ndarray, draws: int) -> np.ndarray:
    """Forces on log10 E (draws, S) of clips (S, T, R, R, 3), the same noise for all of them."""
    guide, config = bundled_image_guide(PROMPT), DistillationConfig()
    slopes = np.gradient(clips, decades, axis=0)
    count = clips.shape[1]
    angles = jnp.full(count, AZIMUTH), jnp.full(count, ELEVATION)

    @jax.jit
    def force(clip, slope, key):
        gradient = guide.distil(clip, *angles, key, config, 0.0).gradient
        return jnp.sum(gradient * 2 * slope) / count  # the prior sees 2 x - 1

    keys = jax.random.split(jax.random.key(0), draws)
    return np.array(
        [[float(force(c, s, key)) for c, s in zip(clips, slopes, strict=True)] for key in keys]
    )


def case(cells: int, stiffnesses: np.ndarray, times: np.ndarray, draws: int) -> Line:
    """The forces on every stiffness."""
    thing = solid("ball", cells)
    red = np.broadcast_to(np.float32(RED), thing.means.shape)
    thing = from_points(np.asarray(thing.means), red, 1.2 / cells)
    scene = scene_of("elastic", {"density": 1000.0, "poisson_ratio": 0.3}, law="neo-Hookean")
    simulation, look = jaxphys.build(scene, thing)
    simulation = simulation.with_(velocity=VELOCITY)
    asked = asked_of(simulation, {"youngs_modulus": Log(1e5)}, times)
    motions = [moved(asked, {"youngs_modulus": float(E)}) for E in stiffnesses]
    clips = np.stack([pictures(look, motion) for motion in motions])
    found = forces(clips, np.log10(stiffnesses), draws)
    return {
        "stiffness": [float(f"{E:.4g}") for E in stiffnesses],
        "force": np.round(found.mean(axis=0), 5).tolist(),
        "standard_error": np.round(found.std(axis=0, ddof=1) / np.sqrt(draws), 5).tolist(),
        "height": [float(f"{np.ptp(m.position[-1][:, 2]):.4g}") for m in motions],
        "pixels": [float(f"{np.sqrt(np.mean((c - clips[-1]) ** 2)):.4g}") for c in clips],
        "draws": draws,
        "frames": len(times),
        "particles": simulation.config.particles,
    }


def cases(quick: bool) -> Cases:
    """The one."""
    size = (6, STIFFNESSES[::5], TIMES[:3], 2) if quick else (10, STIFFNESSES, TIMES, DRAWS)
    return {"image prior": partial(case, *size)}


def losses(line: Line) -> np.ndarray:
    """The force, integrated over log10 E from the softest on."""
    force, decades = np.array(line["force"]), np.log10(line["stiffness"])
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(decades)
    return np.concatenate([[0.0], np.cumsum(steps)])


def draw(line: Line, path: Path) -> None:
    """The loss and its slope over the stiffness."""
    import matplotlib.pyplot as plt

    E, force, error = (np.array(line[n]) for n in ("stiffness", "force", "standard_error"))
    figure, axes = plt.subplots(1, 2, figsize=(8, 2.8), layout="constrained")
    axes[0].plot(E, losses(line), "o-")
    axes[0].set(ylabel="loss, from the softest on")
    axes[1].errorbar(E, force, 2 * error, fmt="o-", capsize=2)
    axes[1].axhline(0, color="grey", lw=0.8)
    axes[1].set(ylabel="slope by log10 E, two standard errors")
    for axis in axes:
        axis.set(xscale="log", xlabel="E [Pa]")
    figure.savefig(path, dpi=90)
    plt.close(figure)


def table(lines: list[Line]) -> str:
    """A row for each stiffness."""
    (line,) = lines
    rows = [
        (f"{E:.3g}", f"{height:.3f}", f"{loss:+.4f}", f"{force:+.4f} ± {2 * error:.4f}")
        for E, height, loss, force, error in zip(
            line["stiffness"], line["height"], losses(line), line["force"],
            line["standard_error"], strict=True,
        )
    ]  # fmt: skip
    head = ("E [Pa]", "height in the last frame [m]", "loss", "its slope by log10 E")
    return markdown(head, rows)
