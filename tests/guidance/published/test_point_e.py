from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax import nnx
from safetensors.numpy import save_file

from experiments.parity.arrays import pseudo_random, weights
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.point_prior import to_frame
from jaxphys.guidance.diffusion.karras import sample_karras
from jaxphys.guidance.diffusion.samplers import karras_ratios
from jaxphys.guidance.diffusion.schedule import expand
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig, score_distillation
from jaxphys.guidance.published.point_e import (
    BASE_SCHEDULE,
    BIASES,
    SCALES,
    PointE,
    PointEGuide,
    PointEPriorConfig,
    PointESampling,
    base_denoiser,
    facing_minus_y,
    from_point_e_frame,
    load_point_e,
    point_e_distillation,
    sample_point_e,
    to_point_e_frame,
    unscaled,
    upsampler_denoiser,
)
from jaxphys.networks.parameters import fill, named_parameters, published_name, published_shape
from jaxphys.networks.point_e import PointEBase, PointEConfig, PointEUpsampler

TESTS = Path(__file__).parents[2]
CONFIG = PointEConfig(width=16, layers=2, heads=2, text=8, grid=(3, 6))
FEW = PointEPriorConfig(points=8, added=7)
QUICK = PointESampling(steps=4)
TEXT = pseudo_random("text", (3, 8))[:1].astype(np.float64)
TEXT = jnp.asarray(TEXT / np.linalg.norm(TEXT))
RUN = nnx.jit(lambda network, *inputs: network(*inputs))
DISTIL = DistillationConfig(guidance=3.0, rescale=0.0, time=(0.1, 0.6, 0.6))


def arrays_of(kind):
    found = named_parameters(nnx.eval_shape(lambda: kind(CONFIG)))
    shapes = {published_name(n): published_shape(n, leaf.shape) for n, leaf in found.items()}
    published = {"channel_scales": SCALES, "channel_biases": BIASES}
    return weights(shapes) | {n: array for n, array in published.items() if n in shapes}


def tiny(dtype=jnp.float64, upsampler=True):
    def load(kind):
        return fill(lambda: kind(CONFIG), arrays_of(kind), source="test", dtype=dtype)

    return PointE(load(PointEBase), load(PointEUpsampler) if upsampler else None, FEW)


class OneObject(nnx.Module):
    """A prior that knows a single cloud (points, 6), given as its samples are, whatever it sees."""

    def __init__(self, cloud):
        self.config, self.schedule, self.cloud = FEW, BASE_SCHEDULE, nnx.Variable(cloud)
        self.upsampler = None

    def __call__(self, noisy, time, condition):
        alpha, sigma = (expand(s, noisy) for s in self.schedule.alpha_sigma(time))
        return (noisy - alpha * self.cloud[...]) / sigma


def nose() -> np.ndarray:
    """Samples of a cloud as Point-E draws them: a red nose at the front, -y, and a blue body."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.2, 0.2, (8, 3)) * [1, 1, 2]
    points[0] = [0.0, -0.5, 0.1]
    colours = np.where(np.arange(8)[:, None] == 0, [255, 0, 0], [0, 0, 255])
    return SCALES * np.concatenate([points, colours], axis=1) + BIASES


def cloud(count=8, seed=1):
    rng = np.random.default_rng(seed)
    return jnp.asarray(rng.uniform(-0.4, 0.4, (count, 3))), jnp.asarray(
        rng.uniform(size=(count, 3))
    )


def test_what_faces_x_here_faces_minus_y_there():
    points = jnp.array([[0.5, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.2]])  # front, left, top
    turned = facing_minus_y(points)
    np.testing.assert_array_equal(turned, [[0, -0.5, 0], [0.3, 0, 0], [0, 0, 0.2]])
    np.testing.assert_allclose(np.linalg.det(facing_minus_y(jnp.eye(3))), 1.0)  # no reflection


def test_frames_round_trip_and_scales_are_those_of_the_bundled_prior():
    points, colours = cloud()
    samples = to_point_e_frame(points, colours)
    assert samples[:, 3:].max() > 200
    back = from_point_e_frame(samples)
    np.testing.assert_allclose(back[0], points, atol=1e-15)
    np.testing.assert_allclose(back[1], colours, atol=1e-15)
    scaled = SCALES * samples + BIASES
    np.testing.assert_allclose(scaled, to_frame(facing_minus_y(points), colours), atol=1e-12)
    np.testing.assert_allclose(unscaled(scaled), samples, atol=1e-12)
    np.testing.assert_array_equal(from_point_e_frame(samples + 300)[1], 1.0)


def test_prior_predicts_the_base_networks_noise_at_the_nearest_step():
    prior = tiny(upsampler=False)
    noisy = jnp.asarray(pseudo_random("noisy", (1, 8, 6)), jnp.float64)
    found = RUN(prior, noisy, jnp.array([500.4 / 1023]), TEXT)
    expected = RUN(prior.base, noisy, jnp.array([500]), TEXT)
    np.testing.assert_allclose(found, expected[..., :6], atol=1e-12)
    assert prior.config.kind == "noise" and found.dtype == noisy.dtype


def test_a_prior_in_half_precision_answers_in_the_samples_precision():
    noisy = jnp.asarray(pseudo_random("noisy", (1, 8, 6)))
    told = (jnp.array([0.5], jnp.float32), TEXT)
    found = RUN(tiny(jnp.bfloat16, upsampler=False), noisy, *told)
    assert found.dtype == jnp.float32
    expected = RUN(tiny(upsampler=False), noisy.astype(float), *told)
    np.testing.assert_allclose(found, expected, atol=0.15)


@pytest.mark.parametrize("span", ["", "_published"])
def test_sampling_is_the_reference(span):
    prior = tiny()
    largest = (120.0, 160.0) if span else (0.4, 0.4)
    coarse_noise, fine_noise = (
        jnp.asarray(pseudo_random(f"{name} noise", (1, count, 6), 1.7), jnp.float64)
        for name, count in (("coarse", 8), ("fine", 7))
    )

    @nnx.jit
    def draw(prior, told):
        sigmas = karras_ratios(10, largest[0], 1e-3, 7.0)
        coarse = unscaled(sample_karras(base_denoiser(prior, TEXT, 3.0), coarse_noise, sigmas))
        sigmas = karras_ratios(10, largest[1], 1e-3, 7.0)
        return coarse, unscaled(sample_karras(upsampler_denoiser(prior, told), fine_noise, sigmas))

    with np.load(TESTS / "networks" / "golden" / "point_e_sampling.npz") as golden:
        coarse, fine = draw(prior, jnp.asarray(golden["coarse"]))
        # Compared in [-1, 1]: the phases of the step's waves are float32, as published.
        for found, name in ((coarse, "coarse"), (fine, "fine")):
            np.testing.assert_allclose(
                SCALES * found, SCALES * golden[name + span], rtol=0, atol=1e-4
            )


def test_clouds_are_as_large_as_asked_for_and_all_of_one_object():
    prior, key = tiny(), jax.random.key(0)
    few, few_colours = sample_point_e(prior, TEXT, key, count=5, config=QUICK)
    more, _ = sample_point_e(prior, TEXT, key, count=15, config=QUICK)
    most, colours = sample_point_e(prior, TEXT, key, count=16, config=QUICK)
    assert few.shape == few_colours.shape == (1, 8, 3) and more.shape == (1, 15, 3)
    assert most.shape == colours.shape == (1, 22, 3)
    np.testing.assert_array_equal(few, more[:, :8])
    np.testing.assert_array_equal(few, most[:, :8])
    assert np.abs(most[:, 8:15] - most[:, 15:]).max() > 0.01
    assert np.abs(most).max() < 1.6 and colours.min() >= 0 and colours.max() <= 1


def test_clouds_follow_key_and_text():
    prior, key = tiny(upsampler=False), jax.random.key(0)
    mild = PointESampling(steps=4, largest=0.4)
    found, _ = sample_point_e(prior, TEXT, key, count=8, config=mild)
    again, _ = sample_point_e(prior, TEXT, key, count=8, config=mild)
    other, _ = sample_point_e(prior, TEXT, jax.random.key(1), count=8, config=mild)
    untold, _ = sample_point_e(prior, jnp.zeros_like(TEXT), key, count=8, config=mild)
    np.testing.assert_array_equal(found, again)
    assert np.abs(found - other).max() > 0.01 and np.abs(found - untold).max() > 0.01


def test_an_object_that_faces_minus_y_there_is_drawn_facing_x():
    points, colours = sample_point_e(
        OneObject(nose()), TEXT, jax.random.key(0), count=8, config=QUICK
    )
    red = int(np.argmax(colours[0, :, 0]))
    np.testing.assert_allclose(points[0, red], [0.5, 0.0, 0.1], atol=1e-6)
    np.testing.assert_allclose(colours[0, red], [1, 0, 0], atol=1e-6)


def test_more_points_than_the_base_draws_need_the_upsampler():
    with pytest.raises(InputError, match=r"8 points, 9 .*upsample_40m\.pt"):
        sample_point_e(tiny(upsampler=False), TEXT, jax.random.key(0), count=9)


def gradients(distil, points, colours):
    value = lambda points, colours: distil(points, colours).value  # noqa: E731
    return jax.jit(jax.grad(value, argnums=(0, 1)))(points, colours)


def test_distillation_turns_the_gradient_back():
    """What the prior wants in its frame, seen in ours; a forgotten turn would be noticed."""
    prior, key = tiny(upsampler=False), jax.random.key(3)
    points, colours = cloud()

    def theirs(points, colours):
        """All 8 points in the order that the subset has them, of a cloud that is not turned."""
        order = jax.random.permutation(jax.random.split(key)[0], 8)
        samples = to_frame(points, colours)[order][None]
        inner = jax.random.split(key)[1]
        return score_distillation(prior, samples, TEXT, jnp.zeros_like(TEXT), inner, DISTIL)

    ours = gradients(
        lambda p, c: point_e_distillation(prior, p, c, TEXT[0], key, DISTIL), points, colours
    )
    wanted = gradients(theirs, facing_minus_y(points), colours)
    np.testing.assert_allclose(facing_minus_y(ours[0]), wanted[0], atol=1e-12)
    np.testing.assert_allclose(ours[1], wanted[1], atol=1e-12)
    forgotten = gradients(theirs, points, colours)
    assert np.abs(forgotten[0] - ours[0]).max() > 0.01 * np.abs(ours[0]).max()


def test_distillation_pulls_the_object_to_face_x():
    """Every point towards the one of the object that the random subset has in its place."""
    prior = OneObject(nose())
    config = DistillationConfig(guidance=1.0, rescale=0.0, weight="clean", limit=None)
    points, colours = cloud()
    pull = gradients(
        lambda p, c: point_e_distillation(prior, p, c, TEXT[0], jax.random.key(0), config),
        points,
        colours,
    )
    # The gradient is the difference to the clean sample, which has twice the points' units.
    wanted = (points - pull[0] / 4, colours - pull[1] / 4)
    red = int(np.argmax(wanted[1][:, 0]))
    np.testing.assert_allclose(wanted[0][red], [0.5, 0, 0.1], atol=1e-9)
    np.testing.assert_allclose(wanted[1][red], [1, 0, 0], atol=1e-9)
    object_points, object_colours = from_point_e_frame(jnp.asarray((nose() - BIASES) / SCALES))
    for found, known in zip(wanted, (object_points, object_colours), strict=True):
        np.testing.assert_allclose(np.sort(found, axis=0), np.sort(known, axis=0), atol=1e-9)


def test_distillation_judges_subsets_of_a_larger_cloud():
    prior, points = tiny(upsampler=False), cloud(20)
    found = gradients(
        lambda p, c: point_e_distillation(prior, p, c, TEXT[0], jax.random.key(0), DISTIL), *points
    )
    assert np.sum(np.abs(found[0]).max(1) > 0) == 8
    with pytest.raises(InputError, match="8 Gaussians or more"):
        point_e_distillation(prior, *cloud(7), TEXT[0], jax.random.key(0), DISTIL)


def test_a_guide_passes_through_jit():
    guide = PointEGuide(tiny(upsampler=False), TEXT[0])
    points, colours = cloud(20)

    @nnx.jit
    def distil(guide, points):
        return guide.distil(points, colours, jax.random.key(0), DISTIL, 0.5)

    found = distil(guide, points)
    assert np.isfinite(found.value) and found.gradient.shape == (1, 8, 6)
    drawn = guide.sample(jax.random.key(0), 8)
    assert drawn[0].shape == drawn[1].shape == (8, 3) and np.isfinite(drawn[0]).all()


SIZES = {"base_config": CONFIG, "upsampler_config": CONFIG, "config": FEW}


def test_networks_are_read_from_their_files(tmp_path):
    save_file(arrays_of(PointEBase), tmp_path / "base.safetensors")
    save_file(arrays_of(PointEUpsampler), tmp_path / "more.safetensors")
    alone = load_point_e(tmp_path / "base.safetensors", **SIZES)
    kernel = alone.base.input_proj.kernel[...]
    np.testing.assert_array_equal(kernel, arrays_of(PointEBase)["input_proj.weight"].T)
    assert alone.upsampler is None
    files = (tmp_path / "base.safetensors", tmp_path / "more.safetensors")
    prior = load_point_e(*files, dtype=jnp.bfloat16, **SIZES)
    assert prior.base.input_proj.kernel[...].dtype == jnp.bfloat16
    assert prior.upsampler.input_proj.kernel[...].dtype == jnp.bfloat16
    np.testing.assert_allclose(prior.upsampler.channel_scales[...], SCALES, rtol=1e-6)


def test_files_of_other_networks_are_refused(tmp_path):
    save_file(arrays_of(PointEBase), tmp_path / "base.safetensors")
    changed = arrays_of(PointEUpsampler) | {"channel_scales": np.full(6, 2.0, np.float32)}
    save_file(changed, tmp_path / "more.safetensors")
    with pytest.raises(InputError, match=r"more\.safetensors: array 'channel_scales' .*published"):
        load_point_e(tmp_path / "base.safetensors", tmp_path / "more.safetensors", **SIZES)
    with pytest.raises(InputError, match=r"more\.safetensors: array '.*' belongs to no part"):
        load_point_e(tmp_path / "more.safetensors", **SIZES)
    with pytest.raises(InputError, match=r"state\.pt: array 'norm.*' belongs to no part"):
        load_point_e(TESTS / "weights" / "golden" / "state.pt", **SIZES)
    with pytest.raises(InputError, match=r"none\.pt"):
        load_point_e(tmp_path / "none.pt", **SIZES)
