"""The player's own functions, in node: decoding, covariance, order and camera."""

import json
import shutil
import subprocess
from importlib.resources import files

import numpy as np
import pytest

from jaxphys.page.motion_data import pack
from jaxphys.render.camera import orbit, position
from tests.page.moving import covariances, tumbling, unpacked

PLAYER = files("jaxphys.page").joinpath("player.js")
SCRIPT = """
const p = require(process.argv[1]);
const given = JSON.parse(require("fs").readFileSync(0, "utf8"));
(async () => {
  const bytes = await p.inflated(p.bytesOf(given.payload));
  const words = p.wordsOf(given.header, bytes);
  const frames = given.frames.map((t) =>
    [...p.frameOf(given.header, bytes, words, t, new Float32Array(p.ROOM * given.header.count))]);
  const orders = given.rows.map((row) =>
    [...p.orderByDepth(Float32Array.from(given.places), given.places.length / 3, row)]);
  let damaged = "";
  try { p.wordsOf(given.header, bytes.slice(1)); } catch (error) { damaged = error.message; }
  console.log(JSON.stringify({ frames, orders, damaged, camera: p.cameraOf(given.view) }));
})();
"""


@pytest.fixture(scope="module")
def node():
    """Runs SCRIPT on a value."""
    program = shutil.which("node")
    if program is None:
        pytest.skip("NO NODE IS INSTALLED: the player's functions were not run")

    def run(value):
        done = subprocess.run(
            [program, "-e", SCRIPT, str(PLAYER)],
            input=json.dumps(value), capture_output=True, text=True, timeout=60,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


def test_decoding_order_and_camera(node):
    moving = tumbling(count=70, frames=4)
    packed = pack(moving, 1_000_000)
    places = np.random.default_rng(3).normal(size=(500, 3))
    rows = np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 0.0], [1e-4, -1.0, 0.0]])
    view = {
        "target": [0.1, 0.2, 0.3], "distance": 3.0, "azimuth": 0.7, "elevation": -0.4,
        "axes": np.eye(3).tolist(),
    }  # fmt: skip
    got = node(
        {
            "header": packed.header,
            "payload": packed.payload,
            "frames": [0, 3],
            "places": places.ravel().tolist(),
            "rows": rows.tolist(),
            "view": view,
        }
    )
    means, quaternions, sizes, shades = unpacked(packed.header, packed.payload)
    full = covariances(quaternions, sizes)
    rgb = np.round(255 * shades[:, :3]).astype(int)
    for values, t in zip(got["frames"], (0, 3), strict=True):
        table = np.array(values).reshape(70, 12)
        assert table[:, :3] == pytest.approx(means[t], abs=1e-6)
        assert table[:, 3] == pytest.approx(shades[:, 3], abs=1e-6)
        upper = full[t][:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
        assert table[:, 4:10] == pytest.approx(upper, rel=1e-5, abs=1e-8)
        assert (table[:, 10] == rgb @ [65536, 256, 1]).all()
    for order, row in zip(got["orders"], rows, strict=True):
        assert sorted(order) == list(range(500))
        depths = places @ row
        coarse = np.ptp(depths) / 65535
        assert np.all(np.diff(depths[order]) <= 1.01 * coarse)  # farthest first
    assert got["orders"][1] == list(range(500))  # of equal depths the first stays first
    assert "damaged" in got["damaged"]
    camera = orbit((0.1, 0.2, 0.3), 3.0, 0.7, -0.4, width=10, height=10)
    assert np.array(got["camera"]["rows"]) == pytest.approx(np.asarray(camera.rotation), abs=1e-6)
    assert got["camera"]["eye"] == pytest.approx(np.asarray(position(camera)), abs=1e-6)
