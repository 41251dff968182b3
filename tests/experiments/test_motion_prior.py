"""The prior of motion: what a clip is, what its slope is, and whether words tell clips apart."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.fitting import clips, guided, train_motion
from experiments.fitting.scenes import moved
from jaxphys.guidance.bundled.pixel_prior import PixelCondition
from jaxphys.guidance.diffusion.schedule import add_noise


def test_frames_stand_in_rows_as_they_come():
    side = clips.PIXELS
    frames = np.zeros((9, side, side, 1))
    frames[:] = np.arange(9)[:, None, None, None]
    frames[4, 3, 5] = 100
    sheet = clips.arranged(frames)
    assert sheet.shape == (3 * side, 3 * side, 1)
    np.testing.assert_array_equal(sheet[::side, ::side, 0], [[0, 1, 2], [3, 4, 5], [6, 7, 8]])
    assert sheet[side + 3, side + 5, 0] == 100


def test_every_stiffness_has_its_word():
    known = list(clips.SENTENCES.values())
    assert [a[1] for a in known[:-1]] == [b[0] for b in known[1:]]  # no gaps
    inside = np.array([[low * 1.01, high * 0.99] for low, high in known])
    np.testing.assert_array_equal(clips.names(inside), [[0, 0], [1, 1], [2, 2]])


@pytest.fixture(scope="module")
def ball():
    return clips.falling(guided.VELOCITY)


@pytest.mark.slow
def test_the_slope_of_a_sheet_is_that_of_its_differences(ball):
    """Through renderer and rollout, in float32: central differences of a hundredth of a decade."""
    see = guided.watched(*ball)
    sheet, slope = see(4.5)
    differences = (see(4.51)[0] - see(4.49)[0]) / 0.02
    size = np.linalg.norm(differences)
    assert 0.9 < np.linalg.norm(slope) / size < 1.1
    assert np.linalg.norm(slope - differences) < 0.1 * size
    np.testing.assert_allclose(
        sheet, clips.sheet(ball[1], moved(ball[0], {"youngs_modulus": 10**4.5}))[0], atol=2e-4
    )


@pytest.mark.slow
@pytest.mark.skipif(not train_motion.WEIGHTS.exists(), reason="THE MOTION PRIOR IS NOT TRAINED")
def test_words_tell_clips_apart(ball):
    """Noise is seen best through the sentence that is true: of three clips at four noise levels
    each, all right. Negative control: through the wrong sentences it is not.
    """
    problem, look = ball
    prior, told = train_motion.load_motion_prior(), train_motion.texts()
    right = 0
    for k, (low, high) in enumerate(clips.SENTENCES.values()):
        motion = moved(problem, {"youngs_modulus": float(np.sqrt(low * high))})
        clean = 2 * clips.sheet(look, motion)[0] - 1
        errors = []
        for text in told:
            noise = jax.random.normal(jax.random.key(5), (16, *clean.shape))
            time = jnp.linspace(0.3, 0.8, 16)
            noisy = add_noise(prior.schedule, jnp.broadcast_to(clean, noise.shape), noise, time)
            condition = PixelCondition(
                jnp.broadcast_to(text, (16, *text.shape)), train_motion.views(16)
            )
            errors.append(float(jnp.mean((prior(noisy, time, condition) - clean) ** 2)))
        right += int(np.argmin(errors) == k)
    assert right == 3
