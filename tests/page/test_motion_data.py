"""What a page holds of a motion is the motion, to the bounds of its quantisation."""

import dataclasses

import numpy as np
import pytest

from jaxphys.core.ellipsoid_axes import CUBE, CUBE_QUATERNIONS
from jaxphys.core.errors import InputError
from jaxphys.gaussians.thinning import some_of
from jaxphys.page.motion_data import continued, every, pack
from tests.page.moving import covariances, rotation, tumbling, unpacked

ROOM = 4_000_000


def test_a_packed_motion_reads_back_within_half_a_step():
    moving = tumbling()
    packed = pack(moving, ROOM)
    means, quaternions, sizes, shades = unpacked(packed.header, packed.payload)
    assert packed.stride == 1 and not packed.notes
    step = np.array(packed.header["step"])
    assert step == pytest.approx(np.ptp(moving.means, axis=(0, 1)) / 65535)
    assert np.all(np.abs(means - moving.means) <= 0.5001 * step)
    seen = np.concatenate([moving.colours, moving.opacities[:, None]], 1)
    assert np.abs(shades - seen).max() <= 0.5001 / 255
    # Axes may have changed their names, so that the ellipsoids are compared. Components of a unit
    # quaternion are off by sqrt(1/2)/2047 at most, the one left out by little more; angles by twice
    # the length of that, and log scales by half a step.
    angle = 2 * 2.5 * np.sqrt(0.5) / 2047
    scale = 0.5001 * packed.header["size_step"]
    got = covariances(quaternions, sizes)
    wanted = covariances(moving.quaternions, moving.log_scales)
    largest = np.exp(2 * moving.log_scales.max(-1))
    bound = (np.expm1(2 * scale) + 2 * angle) * largest
    assert np.all(np.linalg.norm(got - wanted, axis=(-2, -1), ord=2) <= bound)
    assert np.median(np.linalg.norm(got - wanted, axis=(-2, -1), ord=2) / largest) < 3e-3


def test_naming_axes_anew_changes_no_ellipsoid_and_keeps_them_near():
    moving = tumbling(count=50)
    random = np.random.default_rng(1)
    shuffled_q, shuffled_s = moving.quaternions.copy(), moving.log_scales.copy()
    from tests.page.moving import product

    for t in range(len(shuffled_q)):
        which = random.integers(24, size=50)
        shuffled_q[t] = product(shuffled_q[t], CUBE_QUATERNIONS[which])
        shuffled_s[t] = np.take_along_axis(
            shuffled_s[t], np.argmax(np.abs(CUBE), axis=1)[which], -1
        )
    unit = shuffled_q / np.linalg.norm(shuffled_q, axis=-1, keepdims=True)
    q, s = continued(unit, shuffled_s)
    assert covariances(q, s) == pytest.approx(
        covariances(moving.quaternions, moving.log_scales), abs=1e-12
    )
    nearness = np.abs(np.sum(q[1:] * q[:-1], -1))
    assert nearness.min() > np.cos(0.15 / 2) - 1e-9  # what it really turned between frames
    assert np.abs(np.diff(s, axis=0)).max() < 0.021
    assert (
        sorted({tuple(np.round(rotation(t)).ravel()) for t in CUBE_QUATERNIONS})
        and len(CUBE_QUATERNIONS) == 24
    )
    assert len({tuple(np.round(rotation(t)).ravel()) for t in CUBE_QUATERNIONS}) == 24


def test_what_does_not_fit_loses_frames_first_and_then_gaussians_and_says_so():
    moving = tumbling(count=400, frames=96)
    whole = len(pack(moving, ROOM).payload)
    fewer = pack(moving, 7 * whole // 10)
    assert fewer.stride == 2 and fewer.header["count"] == 400
    assert fewer.notes == ("One of 2 frames is here; the film has all 96.",)
    assert fewer.header["seconds"] == pytest.approx(moving.seconds[::2], abs=1e-6)
    small = pack(moving, whole // 9)
    count = small.header["count"]
    assert small.stride == 4 and count < 400 and len(small.payload) <= whole // 9
    assert small.notes[0].startswith(f"Thinned from 400 Gaussians to {count}, each ")
    means, _, sizes, _ = unpacked(small.header, small.payload)
    chosen = some_of(400, count)
    kept = every(moving, 4)
    assert np.abs(means - kept.means[:, chosen]).max() < 1e-3
    volume = sizes.sum(-1) - kept.log_scales[:, chosen].sum(-1)
    assert volume == pytest.approx(1.5 * np.log(400 / count), abs=3e-3)
    with pytest.raises(InputError, match="--megabytes"):
        pack(moving, 2000)


def test_what_stands_still_or_is_alone_can_be_packed():
    one = tumbling(count=1, frames=1)
    means, _, sizes, _ = unpacked(*_parts(one))
    assert means == pytest.approx(one.means) and sizes[0, 0] == pytest.approx(
        np.sort(one.log_scales[0, 0])[_ranks(sizes[0, 0])], abs=1e-3
    )
    broken = dataclasses.replace(one, means=one.means * np.nan)
    with pytest.raises(InputError, match="not finite"):
        pack(broken, ROOM)


def _parts(moving):
    packed = pack(moving, ROOM)
    return packed.header, packed.payload


def _ranks(values):
    return np.argsort(np.argsort(values))


def test_equal_motions_are_packed_to_equal_bytes():
    assert pack(tumbling(), ROOM) == pack(tumbling(), ROOM)
