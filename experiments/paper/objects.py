"""Objects of a sentence by the bundled priors, as the paper makes them and without single parts."""

import dataclasses
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from experiments.paper.things import sentence_of
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.guidance import choice
from jaxphys.guidance.guides import Guides, ShapeGuide
from jaxphys.guidance.optimise import OptimiseConfig, text_to_gaussians
from jaxphys.guidance.prompts.refine import refine


@dataclass(frozen=True)
class Making:
    """How an object is made of a sentence; the defaults are the paper's method.

    Attributes:
        wordy: the sentence speaks of surroundings, see `sentence_of`.
        refined: the sentence is refined, by fixed rules.
        guided: the 3D prior's distillation takes part.
        started: Gaussians start at a cloud drawn from the 3D prior; else in a grey ball.
    """

    wordy: bool = False
    refined: bool = True
    guided: bool = True
    started: bool = True


OURS = "ours"
MAKINGS = {
    OURS: Making(),
    "without refinement": Making(refined=False),
    "without refinement, wordy sentence": Making(wordy=True, refined=False),
    "without 3D guidance": Making(guided=False),
    "without the 3D prior": Making(guided=False, started=False),
}


class FromBall(NamedTuple):
    """A 3D prior that judges, but does not say where Gaussians start: they fill a grey ball."""

    guide: ShapeGuide

    def sample(self, key: Array, count: int) -> tuple[Array, Array]:
        """Points (count, 3), uniform in a ball of diameter 1, and colours (count, 3)."""
        towards, out = jax.random.split(key)
        directions = jax.random.normal(towards, (count, 3))
        directions = directions / jnp.linalg.norm(directions, axis=1, keepdims=True)
        radius = 0.5 * jnp.cbrt(jax.random.uniform(out, (count, 1)))
        return radius * directions, jnp.full((count, 3), 0.5)

    def distil(self, points, colours, key, config, progress):
        """As the prior's."""
        return self.guide.distil(points, colours, key, config, progress)


def prompt_of(name: str, making: Making) -> str:
    """What the priors are told."""
    sentence = sentence_of(name, wordy=making.wordy)
    return refine(sentence, how="rules").refined if making.refined else sentence


def config_of(making: Making, steps: int | None = None) -> OptimiseConfig:
    """The two stages of the paper; steps: of both together, None: as many as usual."""
    config = choice.settings(choice.BUNDLED, choice.BUNDLED, stages="two")
    if steps is not None:
        every = min(config.density_every, max(1, steps // 2))
        config = dataclasses.replace(config, steps=steps, density_every=every)
    if not making.guided:
        stages = tuple(dataclasses.replace(stage, shape=False) for stage in config.stages)
        config = dataclasses.replace(config, stages=stages)
    return config


def guides_of(name: str, making: Making) -> Guides:
    """The bundled priors, told."""
    guides = choice.guides(prompt_of(name, making))
    return guides if making.started else Guides(guides.image, FromBall(guides.shape))


def make(name: str, seed: int, making: Making, steps: int | None = None) -> Gaussians:
    """The object, the same for the same arguments."""
    return text_to_gaussians(
        prompt_of(name, making),
        seed=seed,
        config=config_of(making, steps),
        guides=guides_of(name, making),
    )
