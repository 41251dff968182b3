"""USD: the text is read back by its grammar, and by OpenUSD itself where it is installed."""

import re
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.export import NumberedGaussians, write_usda
from tests.export.cases import cloud, opacity, unit

RADIANCE = "radiance:sphericalHarmonicsCoefficients"


def motion(count=40, degree=1):
    """Centres change from frame to frame, scales from frame 2 on, the rest never."""
    given = cloud(count, degree=degree)
    frames = []
    for number in range(3, 8):
        later = replace(
            given,
            means=given.means + 0.1 * number,
            log_scales=given.log_scales + 0.2 * max(number - 5, 0),
        )
        frames.append(NumberedGaussians(number, later))
    return frames


def values(text):
    return np.array([float(x) for x in re.findall(r"[-+.\deE]+", text)], np.float32)


def parsed(path):
    """What stands in the file: settings, and of each attribute its type and its values by code."""
    text = path.read_text()
    assert text.startswith("#usda 1.0\n") and text.count("{") == text.count("}")
    settings = dict(re.findall(r"^    (\w+) = (.+)$", text, re.MULTILINE))
    attributes = {}
    for kind, name, array in re.findall(r"^        (\S+\[\]) (\S+) = \[(.*)\]$", text, re.M):
        attributes[name] = kind, {None: values(array)}
    pattern = r"^        (\S+\[\]) (\S+)\.timeSamples = \{\n(.*?)^        \}$"
    for kind, name, body in re.findall(pattern, text, re.M | re.S):
        rows = re.findall(r"^            (\S+): \[(.*)\],$", body, re.M)
        assert len(rows) == body.count("\n")
        attributes[name] = kind, {float(code): values(array) for code, array in rows}
    return text, settings, attributes


def test_a_round_trip_keeps_float32_to_the_bit(tmp_path):
    frames = motion()
    write_usda(tmp_path / "a.usda", frames, 24.0)
    text, settings, attributes = parsed(tmp_path / "a.usda")
    assert settings["upAxis"] == '"Z"' and settings["metersPerUnit"] == "1"
    assert settings["timeCodesPerSecond"] == "24"
    assert (settings["startTimeCode"], settings["endTimeCode"]) == ("3", "7")
    assert 'def ParticleField3DGaussianSplat "Splats"' in text
    assert "uniform int radiance:sphericalHarmonicsDegree = 1\n" in text
    kind, samples = attributes["positions"]
    assert kind == "point3f[]" and sorted(samples) == [3, 4, 5, 6, 7]
    for frame in frames:
        sample = samples[frame.number].reshape(-1, 3)
        np.testing.assert_array_equal(sample, frame.gaussians.means)
    given = frames[0].gaussians
    kind, samples = attributes["orientations"]
    assert kind == "quatf[]" and list(samples) == [None]  # w, x, y, z
    np.testing.assert_allclose(samples[None].reshape(-1, 4), unit(given.quaternions), atol=1e-7)
    kind, samples = attributes["opacities"]
    assert kind == "float[]"
    np.testing.assert_allclose(samples[None], opacity(given), atol=1e-7)
    kind, samples = attributes[RADIANCE]
    assert kind == "float3[]"
    np.testing.assert_array_equal(samples[None].reshape(given.harmonics.shape), given.harmonics)


def test_what_begins_to_change_later_is_held_until_then(tmp_path):
    """A reader that interpolates between the samples sees no change before frame 5."""
    frames = motion()
    write_usda(tmp_path / "a.usda", frames, 24.0)
    kind, samples = parsed(tmp_path / "a.usda")[2]["scales"]
    assert kind == "float3[]" and sorted(samples) == [3, 5, 6, 7]
    np.testing.assert_array_equal(samples[3], samples[5])
    scales = np.exp(np.asarray(frames[-1].gaussians.log_scales, float))
    np.testing.assert_allclose(samples[7].reshape(-1, 3), scales, rtol=1e-6)


def test_the_extent_holds_three_standard_deviations(tmp_path):
    frames = motion()
    write_usda(tmp_path / "a.usda", frames, 24.0)
    _, samples = parsed(tmp_path / "a.usda")[2]["extent"]
    for frame in frames:
        low, high = samples[frame.number].reshape(2, 3)
        reach = 3 * np.exp(np.asarray(frame.gaussians.log_scales)).max(axis=1, keepdims=True)
        means = np.asarray(frame.gaussians.means)
        assert np.all(means - reach >= low - 1e-5) and np.all(means + reach <= high + 1e-5)


def test_one_frame_has_no_samples(tmp_path):
    write_usda(tmp_path / "a.usda", motion()[:1], 24.0)
    assert "timeSamples" not in (tmp_path / "a.usda").read_text()


@pytest.mark.parametrize("at", [0, 2])
def test_a_failure_leaves_nothing(tmp_path, at):
    frames = motion()
    means = frames[at].gaussians.means.at[1].set(jnp.nan)
    frames[at] = frames[at]._replace(gaussians=replace(frames[at].gaussians, means=means))
    with pytest.raises(InputError, match="means"):
        write_usda(tmp_path / "a.usda", frames, 24.0)
    with pytest.raises(InputError, match="no frames"):
        write_usda(tmp_path / "a.usda", [], 24.0)
    with pytest.raises(InputError, match="other Gaussians"):
        write_usda(tmp_path / "a.usda", [motion()[0], *motion(41)], 24.0)
    assert not list(tmp_path.iterdir())


def test_openusd_reads_it(tmp_path):
    usd = pytest.importorskip("pxr.Usd", reason="usd-core is not installed")
    from pxr import UsdGeom, UsdVol

    frames = motion()
    write_usda(tmp_path / "a.usda", frames, 24.0)
    stage = usd.Stage.Open(str(tmp_path / "a.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1
    splats = UsdVol.ParticleField3DGaussianSplat(stage.GetPrimAtPath("/World/Splats"))
    assert splats
    between = np.array(splats.GetPositionsAttr().Get(4.5))
    np.testing.assert_allclose(between, frames[0].gaussians.means + 0.15, atol=1e-6)
    assert len(splats.GetScalesAttr().Get(6)) == len(between)
