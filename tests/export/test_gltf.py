"""Binary glTF: a file that is read back by the rules of glTF 2.0 alone."""

import json
import struct

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.export import write_glb
from jaxphys.gaussians import harmonics as sh
from tests.export.cases import UP, cloud, covariances, opacity, rotation

NAME = "KHR_gaussian_splatting"


def read_glb(path):
    """The document, and each attribute as the accessors say."""
    data = path.read_bytes()
    magic, version, length = struct.unpack("<4sII", data[:12])
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON" and size % 4 == 0
    document = json.loads(data[20 : 20 + size])
    start = 20 + size
    size, kind = struct.unpack("<I4s", data[start : start + 8])
    assert kind == b"BIN\0" and size % 4 == 0 and start + 8 + size == len(data)
    assert document["buffers"] == [{"byteLength": size}]
    binary = data[start + 8 :]
    (primitive,) = document["meshes"][0]["primitives"]
    arrays = {}
    for name, index in primitive["attributes"].items():
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        dtype = {5126: np.dtype("<f4"), 5121: np.dtype("u1")}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteLength"] == accessor["count"] * width * dtype.itemsize
        array = np.frombuffer(binary, dtype, accessor["count"] * width, view["byteOffset"])
        arrays[name] = array.reshape(accessor["count"], width)
    return document, primitive, arrays


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_round_trip_keeps_all(tmp_path, degree):
    given = cloud(100, degree=degree)
    write_glb(tmp_path / "a.glb", given)
    document, primitive, arrays = read_glb(tmp_path / "a.glb")
    assert document["asset"]["version"] == "2.0" and document["extensionsUsed"] == [NAME]
    assert primitive["mode"] == 0
    splats = primitive["extensions"][NAME]
    assert splats["kernel"] == "ellipse" and splats["colorSpace"] == "srgb_rec709_display"
    count = (degree + 1) ** 2
    assert len(arrays) == 5 + count
    means = np.asarray(given.means, float) @ UP.T
    np.testing.assert_allclose(arrays["POSITION"], means, rtol=1e-6, atol=1e-7)
    accessor = document["accessors"][primitive["attributes"]["POSITION"]]
    np.testing.assert_array_equal(np.float32(accessor["min"]), arrays["POSITION"].min(axis=0))
    np.testing.assert_array_equal(np.float32(accessor["max"]), arrays["POSITION"].max(axis=0))
    xyzw = arrays[f"{NAME}:ROTATION"]
    np.testing.assert_allclose(np.linalg.norm(xyzw, axis=1), 1, atol=1e-6)
    axes = rotation(xyzw[:, [3, 0, 1, 2]]) * arrays[f"{NAME}:SCALE"][:, None].astype(float)
    wanted = UP @ covariances(given) @ UP.T
    size = np.abs(wanted).max(axis=(1, 2), keepdims=True)
    assert np.abs((axes @ np.swapaxes(axes, 1, 2) - wanted) / size).max() < 3e-6
    np.testing.assert_allclose(arrays[f"{NAME}:OPACITY"][:, 0], opacity(given), atol=1e-6)
    # The colour that is seen along a direction of the new world is what was seen along the old.
    written = np.stack(
        [
            arrays[f"{NAME}:SH_DEGREE_{order}_COEF_{m}"]
            for order in range(degree + 1)
            for m in range(2 * order + 1)
        ],
        axis=1,
    )
    directions = np.random.default_rng(1).normal(size=(100, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(
        sh.evaluate(jnp.asarray(written), jnp.asarray(directions @ UP.T, jnp.float32)),
        sh.evaluate(given.harmonics, jnp.asarray(directions, jnp.float32)),
        atol=1e-5,
    )


def test_the_fallback_is_linear_light(tmp_path):
    given = cloud(50, degree=0)
    write_glb(tmp_path / "a.glb", given)
    document, primitive, arrays = read_glb(tmp_path / "a.glb")
    assert document["accessors"][primitive["attributes"]["COLOR_0"]]["normalized"] is True
    rgba = arrays["COLOR_0"] / 255
    shown = np.where(rgba <= 0.0031308, 12.92 * rgba, 1.055 * rgba ** (1 / 2.4) - 0.055)[:, :3]
    wanted = np.asarray(given.harmonics[:, 0]) * 0.28209479 + 0.5
    np.testing.assert_allclose(shown, np.clip(wanted, 0, 1), atol=0.02)
    assert np.abs(rgba[:, 3] - opacity(given)).max() <= 1 / 510 + 1e-6


def test_readers_that_know_no_splats_see_points(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    given = cloud(50, degree=1)
    write_glb(tmp_path / "a.glb", given)
    (points,) = trimesh.load(tmp_path / "a.glb").geometry.values()
    np.testing.assert_allclose(points.vertices, np.asarray(given.means) @ UP.T, atol=1e-5)
    np.testing.assert_array_equal(points.colors, read_glb(tmp_path / "a.glb")[2]["COLOR_0"])
