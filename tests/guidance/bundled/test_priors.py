"""The shipped priors know what they are told: measured on variants of objects they never saw."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx

from experiments.priors.data.pictures import pictures
from experiments.priors.data.prepare import lit_points
from jaxphys import weights
from jaxphys.guidance.bundled.pixel_prior import PixelCondition
from jaxphys.guidance.bundled.point_prior import PointCondition, to_frame
from jaxphys.guidance.bundled.priors import load_pixel_prior, load_point_prior
from jaxphys.guidance.bundled.text_encoder import prompt_embeddings
from jaxphys.guidance.diffusion.schedule import add_noise, interpret
from jaxphys.guidance.views import view_features
from jaxphys.library import PRINCIPAL, usual

UNSEEN = 700  # training used the variants 0 to 39
AZIMUTH, ELEVATION = 0.5, 0.3


@pytest.fixture(scope="module")
def objects():
    """Points (12, 4096, 3) and colours (12, 4096, 3) uint8 of each principal model, and texts."""
    clouds = []
    for name in PRINCIPAL:
        rng = np.random.default_rng(UNSEEN)
        surface = usual(name, UNSEEN).model.sample(6_000, rng)
        clouds.append(lit_points(surface.points, surface.normals, surface.colours, rng))
    points, _, colours = (np.stack(part) for part in zip(*clouds, strict=True))
    return points, colours, jnp.stack([prompt_embeddings(f"a {n}", 0) for n in PRINCIPAL])


def errors(prior, clean, time, told, *others):
    """Mean squared error of the clean estimate under each condition, for the same noise."""
    noise = jax.random.normal(jax.random.key(3), clean.shape)
    times = jnp.full(clean.shape[0], time)
    noisy = add_noise(prior.schedule, clean, noise, times)

    @nnx.jit
    def error(prior, condition):
        prediction = prior(noisy, times, condition)
        estimate = interpret(prior.schedule, prior.config.kind, prediction, noisy, times)
        return jnp.mean((estimate.clean - clean) ** 2)

    return [float(error(prior, condition)) for condition in (told, *others)]


def test_point_prior_denoises_better_when_told_the_truth(objects):
    points, colours, text = objects
    prior, _ = load_point_prior()
    clean = to_frame(points[:, ::16].astype(np.float32), colours[:, ::16] / np.float32(255))
    conditions = text, jnp.zeros_like(text), jnp.roll(text, 1, axis=0)
    told, untold, misled = errors(prior, clean, 0.8, *(PointCondition(c) for c in conditions))
    assert told < 0.97 * untold < 0.97 * misled
    # Better than the mean of all objects. Where on its surface a point lies cannot be told at this
    # noise, so that much of the variance stays.
    assert told < 0.85 * float(jnp.mean((clean - clean.mean((0, 1))) ** 2))


def test_pixel_prior_denoises_better_when_told_the_truth(objects):
    points, colours, text = objects
    prior, _ = load_pixel_prior()
    drawn = [
        pictures(p, c, [AZIMUTH], [ELEVATION])[0] for p, c in zip(points, colours, strict=True)
    ]
    rgba = np.stack(drawn).astype(np.float32) / 255
    clean = jnp.asarray(2 * (rgba[..., :3] * rgba[..., 3:] + 0.6 * (1 - rgba[..., 3:])) - 1)
    view = jnp.broadcast_to(view_features(AZIMUTH, ELEVATION), (len(text), 4))
    conditions = text, jnp.zeros_like(text), jnp.roll(text, 1, axis=0)
    told, untold, misled = errors(
        prior, clean, 0.9, *(PixelCondition(c, view.astype(jnp.float32)) for c in conditions)
    )
    assert told < 0.97 * untold < 0.97 * misled
    assert told < 0.7 * float(jnp.mean((clean - clean.mean((0, 1, 2))) ** 2))


@pytest.mark.parametrize("name", ["point_prior", "pixel_prior"])
def test_manifest_says_how_they_were_made(name):
    entry = weights.manifest()[name]
    for field in ("data", "steps", "seed", "command", "licence", "sha256"):
        assert entry[field] or entry[field] == 0
    told, untold = entry["held_out"], entry["held_out_no_text"]
    levels = sorted(told, key=float)
    assert len(levels) >= 5 and sorted(untold, key=float) == levels
    assert told[levels[-1]] < untold[levels[-1]]
    # More noise leaves less to know.
    values = [told[level] for level in levels]
    assert values == sorted(values)


def test_all_weights_together_are_small():
    assert sum(entry["bytes"] for entry in weights.manifest().values()) <= 30_000_000
