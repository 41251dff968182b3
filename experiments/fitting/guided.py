"""Can a diffusion prior tell how stiff something is from how it moves?

    python -m experiments.fitting guided --out benchmarks/lines/fitting-guided.jsonl

A ball falls; each stiffness makes a clip. Score distillation (Poole et al. 2023) pushes on the
logarithm of the stiffness by the mean of g . dx / d log E over frames and noise, g its gradient of
the pictures x. What it pushes against is the loss: the force, integrated. A prior that can guide
has a least loss at some stiffness between the ends, and the same one for other draws of noise.

Asked are the bundled image prior, of single frames, told "a red ball", and a small prior of whole
clips (`train_motion.py`), told each of three materials. The latter then guides: from too soft and
from too stiff, Adam follows its force, through renderer and the whole rollout.
"""

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax

import jaxphys
from experiments.fitting import clips as filmed
from experiments.fitting.scenes import CAPACITY, SIZE, STEPS, asked_of, moved, scene_of, solid
from experiments.fitting.train_motion import load_motion_prior
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import Log
from jaxphys.fitting.problem import Program
from jaxphys.gaussians import from_points
from jaxphys.guidance.bundled.pixel_guide import PixelGuide, bundled_image_guide
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig
from jaxphys.guidance.views import DISTANCE, FIELD_OF_VIEW, RESOLUTION, camera_position
from jaxphys.render import look_at

PROMPT, RED = "a red ball", (0.8, 0.1, 0.1)
TIMES = np.arange(1, 8) / 24
STIFFNESSES = np.logspace(3.5, 6, 11)
VELOCITY = (0.0, 0.0, -1.5)
AZIMUTH, ELEVATION = 0.4, 0.2
DRAWS = 8  # of noise, of each frame
CLIPS = 64  # draws of noise, of each clip
STARTS = (5e3, 8e5)  # too soft for all that bounces, too stiff for all but the hardest
LENGTH, RATE, NOISES = 80, 0.06, 16  # steps of a descent, their length in decades, draws in each


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


def watched(problem, look):
    """A compiled function of log10 E: the sheet of frames (R, R, 3), and its derivative by it."""
    one, ten = (problem.layout.vector({"youngs_modulus": E}) for E in (1.0, 10.0))

    @jax.jit
    def see(decade, steps):
        def of(decade):
            vector = problem.cast(one) + decade * problem.cast(ten - one)
            motion, _ = problem.motion(vector, len(problem.times), Program(steps, (0,)))
            return filmed.sheet(look, motion)[0]

        return jax.jvp(of, (decade,), (jnp.ones_like(decade),))

    return lambda decade: see(jnp.float32(decade), STEPS)


def pushed(sentence: str, draws: int):
    """A compiled function (sheet, slope, key) -> forces on log10 E (draws,) of the prior of motion
    told a sentence.
    """
    guide = PixelGuide(load_motion_prior(), prompt_embeddings(sentence, 0))
    config = DistillationConfig()
    angles = jnp.full(draws, filmed.AZIMUTH), jnp.full(draws, filmed.ELEVATION)

    @jax.jit
    def push(sheet, slope, key):
        copies = jnp.broadcast_to(sheet, (draws, *sheet.shape))
        gradient = guide.distil(copies, *angles, key, config, 0.0).gradient
        return jnp.sum(gradient * 2 * slope, axis=(1, 2, 3))  # the prior sees 2 x - 1

    return push


def motion_case(stiffnesses: np.ndarray, draws: int) -> Line:
    """The forces on every stiffness by the prior of motion, told each material."""
    problem, look = filmed.falling(VELOCITY)
    see = watched(problem, look)
    seen = [see(np.log10(E)) for E in stiffnesses]
    found = {}
    for sentence in filmed.SENTENCES:
        push = pushed(sentence, draws)
        pushes = [push(*one, jax.random.key(0)) for one in seen]
        found[sentence] = np.array(pushes, np.float64)
    return {
        "stiffness": [float(f"{E:.4g}") for E in stiffnesses],
        "forces": {name: np.round(f.mean(axis=1), 5).tolist() for name, f in found.items()},
        "standard_errors": {
            name: np.round(f.std(axis=1, ddof=1) / np.sqrt(draws), 5).tolist()
            for name, f in found.items()
        },
        "draws": draws,
        "particles": problem.simulation.config.particles,
    }


def descent(sentence: str, start: float, length: int, draws: int) -> Line:
    """Adam on log10 E along the force, from a start."""
    problem, look = filmed.falling(VELOCITY)
    see, push = watched(problem, look), pushed(sentence, draws)
    low, high = (np.log10(end) for end in (2e3, 2e6))
    adam = optax.adam(RATE, b1=0.8, b2=0.95)
    decade = jnp.float32(np.log10(start))
    memory, trail = adam.init(decade), [float(decade)]
    for step in range(length):
        force = jnp.mean(push(*see(decade), jax.random.fold_in(jax.random.key(1), step)))
        update, memory = adam.update(force, memory)
        decade = jnp.clip(decade + update, low, high)
        trail.append(float(decade))
    last = 10 ** np.mean(trail[-max(1, length // 4) :])
    ends = filmed.SENTENCES[sentence]
    return {
        "sentence": sentence,
        "start": start,
        "found": float(f"{last:.4g}"),  # the mean of the last quarter's logarithms
        "within": bool(ends[0] <= last <= ends[1]),
        "trail": np.round(trail, 4).tolist(),
        "draws": draws,
    }


def cases(quick: bool) -> Cases:
    """Each prior's forces, then each material from both sides."""
    size = (6, STIFFNESSES[::5], TIMES[:3], 2) if quick else (10, STIFFNESSES, TIMES, DRAWS)
    found: dict = {
        "image prior": partial(case, *size),
        "motion prior": partial(motion_case, size[1], 4 if quick else CLIPS),
    }
    for sentence in list(filmed.SENTENCES)[: 1 if quick else None]:
        for start in STARTS:
            found[f"{sentence}, from {start:g} Pa"] = partial(
                descent, sentence, start, 3 if quick else LENGTH, 2 if quick else NOISES
            )
    return found


def losses(stiffness: list[float], force: list[float]) -> np.ndarray:
    """The force, integrated over log10 E from the softest on."""
    push, decades = np.array(force), np.log10(stiffness)
    steps = 0.5 * (push[1:] + push[:-1]) * np.diff(decades)
    return np.concatenate([[0.0], np.cumsum(steps)])


def draw(lines: list[Line], path: Path) -> None:
    """The losses over the stiffness, and the way of each descent."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(11, 3), layout="constrained")
    colours = dict(zip(filmed.SENTENCES, ("C1", "C2", "C3"), strict=True))
    for line in lines:
        if "force" in line:
            loss = losses(line["stiffness"], line["force"])
            axes[0].plot(line["stiffness"], loss - loss.min(), "o-", color="C0", label=PROMPT)
        for sentence, force in line.get("forces", {}).items():
            loss = losses(line["stiffness"], force)
            axes[1].plot(
                line["stiffness"], loss - loss.min(), "o-", color=colours[sentence], label=sentence
            )
        if "trail" in line:
            axes[2].plot(10 ** np.array(line["trail"]), color=colours[line["sentence"]])
    for sentence, ends in filmed.SENTENCES.items():
        axes[1].axvspan(*ends, color=colours[sentence], alpha=0.12, lw=0)
        axes[2].axhspan(*ends, color=colours[sentence], alpha=0.12, lw=0)
    axes[0].set(title="a prior of single pictures", ylabel="loss above its least")
    axes[1].set(title="a prior of motion")
    axes[2].set(title="guided by it", yscale="log", xlabel="step", ylabel="E [Pa]")
    for axis in axes[:2]:
        axis.set(xscale="log", xlabel="E [Pa]")
        axis.legend(fontsize=7)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def table(lines: list[Line]) -> str:
    """A row for each stiffness, by each prior; and for each descent."""
    pages = []
    for line in lines:
        if "force" in line:
            pages.append(_image_table(line))
        if "forces" in line:
            pages.append(_motion_table(line))
    rows = [
        (line["sentence"], "{:.3g} to {:.3g}".format(*filmed.SENTENCES[line["sentence"]]),
         f"{line['start']:.3g}", f"{line['found']:.3g}", "yes" if line["within"] else "**no**",
         f"{line['cpu_seconds']:.0f}")
        for line in lines if "trail" in line
    ]  # fmt: skip
    head = ("told", "it means E of [Pa]", "start [Pa]", "found [Pa]", "within", "CPU seconds")
    return "\n\n".join([*pages, *([markdown(head, rows)] if rows else [])])


def _image_table(line: Line) -> str:
    rows = [
        (f"{E:.3g}", f"{height:.3f}", f"{loss:+.4f}", f"{force:+.4f} ± {2 * error:.4f}")
        for E, height, loss, force, error in zip(
            line["stiffness"], line["height"], losses(line["stiffness"], line["force"]),
            line["force"], line["standard_error"], strict=True,
        )
    ]  # fmt: skip
    head = ("E [Pa]", "height in the last frame [m]", "loss", "its slope by log10 E")
    return markdown(head, rows)


def _motion_table(line: Line) -> str:
    rows = [
        (f"{E:.3g}", *(
            f"{line['forces'][name][i]:+.2f} ± {2 * line['standard_errors'][name][i]:.2f}"
            for name in line["forces"]
        ))
        for i, E in enumerate(line["stiffness"])
    ]  # fmt: skip
    return markdown(("E [Pa]", *(f'slope, told "{name}"' for name in line["forces"])), rows)
