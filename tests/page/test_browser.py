"""The page in a real browser, from the disk and offline."""

import io
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

from jaxphys.core.splats import Splats
from jaxphys.page.motion_data import pack
from jaxphys.page.videos import videos_page
from jaxphys.render.camera import orbit
from jaxphys.render.renderer import render
from tests.browsers import started, until
from tests.page.moving import covariances, entry, tumbling, unpacked

pytestmark = pytest.mark.slow
READ = """() => new Promise((done) => document.querySelector("canvas").toBlob(
  async (blob) => done([...new Uint8Array(await blob.arrayBuffer())])))"""


browser = pytest.fixture(scope="module")(started)


@pytest.fixture
def opened(browser, tmp_path):
    """Opens a page of entries; gives it, and what it said, asked for and drew."""
    contexts = []

    def open_page(*entries, without_workers=False):
        (tmp_path / "videos.html").write_text(videos_page(entries))
        context = browser.new_context(
            viewport={"width": 1000, "height": 800}, device_scale_factor=1
        )
        contexts.append(context)
        context.set_offline(True)
        page = context.new_page()
        said, asked = [], []
        page.on("console", lambda line: said.append(line.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        if without_workers:
            page.add_init_script("window.Worker = undefined")
        page.goto((tmp_path / "videos.html").as_uri())
        wait(page, 0)
        return SimpleNamespace(page=page, said=said, asked=asked)

    yield open_page
    for context in contexts:
        context.close()


def wait(page, frame):
    """Until a frame is drawn; says what the page complains of where none comes."""
    until(
        page,
        "jaxphysPage.errors.length > 0"
        f" || (jaxphysPage.frame === {frame} && jaxphysPage.drawn > 0)",
    )
    assert page.evaluate("jaxphysPage.errors") == []


def shown(page):
    """The canvas, (H, W, 3)."""
    data = bytes(page.evaluate(READ))
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), float)


def test_frames_differ_nothing_leaves_and_no_error_is_said(opened):
    got = opened(entry())
    page = got.page
    first = shown(page)
    page.evaluate("jaxphysPage.go(20)")
    wait(page, 20)
    assert np.abs(shown(page) - first).mean() > 2
    page.evaluate("jaxphysPage.go(0)")
    wait(page, 0)
    assert np.array_equal(shown(page), first)
    assert not [line for line in got.said if "film" not in line and "media" not in line]
    assert all(url.startswith(("file:", "blob:null/")) for url in got.asked)
    assert sum(url.startswith("file:") for url in got.asked) == 1
    assert page.evaluate("jaxphysPage.threaded") is True


def test_controls_turn_scrub_and_play(opened):
    page = opened(entry()).page
    first = shown(page)
    page.locator("[data-part=scrub]").fill("7")
    wait(page, 7)
    assert page.locator("[data-part=told]").inner_text().startswith("frame 7, 0.292 s")
    page.locator("[data-part=scrub]").fill("0")
    wait(page, 0)
    drawn = page.evaluate("jaxphysPage.drawn")
    box = page.locator("canvas").bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 80)
    page.mouse.down()
    page.mouse.move(box["x"] + 220, box["y"] + 110, steps=4)
    page.mouse.up()
    until(page, f"jaxphysPage.drawn > {drawn}")
    page.wait_for_timeout(500)
    assert np.abs(shown(page) - first).mean() > 2
    page.locator("[data-part=reset]").click()
    page.wait_for_timeout(500)
    assert np.array_equal(shown(page), first)
    page.locator("[data-part=speed]").select_option("2")
    page.locator("[data-part=play]").click()
    until(page, "jaxphysPage.frame > 3")
    page.locator("[data-part=play]").click()


def test_the_second_object_opens_and_a_page_without_workers_draws_the_same(opened):
    other = entry(tumbling(seed=4, frames=24), title="another")
    page = opened(entry(), other).page
    first = shown(page)
    page.locator("[data-card='1'] [data-part=open]").click()
    until(page, "document.querySelector('[data-card=\"1\"] canvas') !== null")
    page.wait_for_timeout(1500)
    assert page.locator("canvas").count() == 1 and page.evaluate("jaxphysPage.errors") == []
    assert np.abs(shown(page) - first).mean() > 2
    plain = opened(entry(), without_workers=True).page
    assert plain.evaluate("jaxphysPage.threaded") is False
    assert np.array_equal(shown(plain), first)


def test_the_player_draws_what_our_renderer_draws(opened):
    moving = tumbling(count=800, frames=3, seed=2)
    given = entry(moving, surroundings={"background": [1.0, 1.0, 1.0], "colour": [0, 0, 0],
                                        "place": [0.0, 0.0, 0.0, 0.0]})  # fmt: skip
    page = opened(given).page
    picture = shown(page)
    height, width, _ = picture.shape
    packed = pack(moving, 4_000_000)
    means, quaternions, sizes, shades = unpacked(packed.header, packed.payload)
    splats = Splats(
        jnp.asarray(means[0]),
        jnp.asarray(covariances(quaternions[0], sizes[0])),
        jnp.asarray(shades[:, 3]),
        jnp.asarray(shades[:, :3]),
    )
    camera = orbit((0, 0, 1), 7.0, -1.0, 0.25, field_of_view=0.7, width=width, height=height)
    ours = 255 * np.clip(np.asarray(render(splats, camera, background=1.0).colour), 0, 1)
    assert np.abs(ours - 255).mean() > 10  # something is drawn
    # Eight bits a channel round at each of some tens of splats on top of each other.
    assert np.abs(picture - ours).mean() < 1.0
    assert np.quantile(np.abs(picture - ours), 0.99) < 6
