"""Pages of real runs: from kept splats and computed again, on the command line and refused."""

import dataclasses
import json
import re
import shutil

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.gaussians.ply import read_ply
from jaxphys.page.motion_data import pack
from jaxphys.pipeline.animate import animate
from jaxphys.pipeline.replay import replay
from jaxphys.pipeline.videos import write_videos
from jaxphys.scene.scene import Generation
from tests.page.moving import covariances, unpacked
from tests.pipeline.test_animate import small_scene, sphere

FRAMES = 4


def told_scene():
    """The ball of jelly of other tests, so that its programs are compiled once; a sentence stands
    for it."""
    return small_scene(frames=FRAMES, generation=Generation("a <b>ball</b> of jelly"))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    ball = sphere()
    ball = dataclasses.replace(ball, log_scales=ball.log_scales - jnp.array([0.0, 0.7, 1.4]))
    out = tmp_path_factory.mktemp("runs") / "ball"
    return animate(told_scene(), out, objects=(ball,), save_splats=True)


@pytest.fixture(scope="module")
def kept(finished):
    return replay(finished)


def test_kept_splats_are_what_is_packed(finished, kept):
    packed = pack(kept.moving, 4_000_000)
    means, quaternions, sizes, _ = unpacked(packed.header, packed.payload)
    assert means.shape == (FRAMES, 200, 3) and not packed.notes
    rows = [json.loads(line) for line in (finished / "metrics.jsonl").read_text().splitlines()]
    assert packed.header["seconds"] == pytest.approx([row["time"] for row in rows], abs=1e-6)
    for number in range(FRAMES):
        splats = read_ply(finished / "splats" / f"{number:04d}.ply")
        step = np.array(packed.header["step"])
        assert np.all(np.abs(means[number] - np.asarray(splats.means)) <= 0.501 * step)
        wanted = covariances(
            np.asarray(splats.quaternions, float), np.asarray(splats.log_scales, float)
        )
        got = covariances(quaternions[number], sizes[number])
        largest = np.exp(2 * np.asarray(splats.log_scales).max(-1))
        off = np.linalg.norm(got - wanted, axis=(1, 2)) / largest
        assert off.max() < 6e-3


def test_without_them_the_motion_is_computed_again_as_it_was(finished, kept, tmp_path):
    bare = shutil.copytree(finished, tmp_path / "bare")
    shutil.rmtree(bare / "splats")
    again = replay(bare)
    assert not again.moving.notes
    assert again.moving.means == pytest.approx(kept.moving.means, abs=1e-6)
    one, other = (covariances(m.quaternions, m.log_scales) for m in (again.moving, kept.moving))
    assert one == pytest.approx(other, abs=1e-6)
    assert again.moving.colours == pytest.approx(kept.moving.colours, abs=1e-6)
    assert again.view["target"] == pytest.approx(kept.view["target"], abs=1e-5)
    assert again.surroundings["place"] == pytest.approx(kept.surroundings["place"], abs=1e-5)
    rows = (bare / "metrics.jsonl").read_text().splitlines()
    last = json.loads(rows[-1])
    last["centre_of_mass"][2] += 0.1
    (bare / "metrics.jsonl").write_text("\n".join([*rows[:-1], json.dumps(last)]))
    (note,) = replay(bare).moving.notes
    assert "0.1 m from the film" in note


def test_the_command_writes_a_page_and_never_over_anything(finished, tmp_path, capsys):
    out = tmp_path / "videos.html"
    evaluation = {"clip": {"score": 31.25, "model": "<i>ViT</i>"}, "aesthetic": {"1": {"score": 5}}}
    rated = shutil.copytree(finished, tmp_path / "rated")
    (rated / "evaluation.json").write_text(json.dumps(evaluation))
    command = ["page", f"{finished}", f"{rated}", "--out", f"{out}", "--title", "<u>Ours"]
    assert run(command) == 0
    page = out.read_text()
    assert "a &lt;b&gt;ball&lt;/b&gt; of jelly" in page and "<b>ball" not in page
    assert "31.25 (&lt;i&gt;ViT&lt;/i&gt;)" in page and "&lt;u&gt;Ours" in page
    assert len(re.findall('<section data-card="', page)) == 2
    capsys.readouterr()
    assert run(command) == 2 and "--overwrite" in capsys.readouterr().err
    assert run([*command, "--overwrite"]) == 0 and out.read_text() == page
    capsys.readouterr()
    film = f"{finished / 'motion.mp4'}"
    assert run([*command[:3], "--out", film, "--overwrite"]) == 2
    assert "is what is read" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ("nothing", "is no directory"),
        ("config.json", "config.json: is missing"),
        ("motion.mp4", "motion.mp4: is missing"),
        ("rows", "holds no rows of a run"),
        ("splats", "Gaussians"),
        ("--megabytes", "--megabytes"),
    ],
)
def test_what_is_no_finished_run_is_refused_in_a_line(finished, tmp_path, capsys, broken, words):
    folder, options = tmp_path / "run", []
    if broken != "nothing":
        shutil.copytree(finished, folder)
    if broken in ("config.json", "motion.mp4"):
        (folder / broken).unlink()
    elif broken == "rows":
        (folder / "metrics.jsonl").write_text("[]\n")
    elif broken == "splats":
        shutil.copy(folder / "splats/0001.ply", tmp_path / "x.ply")
        text = (tmp_path / "x.ply").read_bytes()
        (folder / "splats/0001.ply").write_bytes(text[:-50])
        words = "0001.ply"
    elif broken == "--megabytes":
        options = ["--megabytes", "0"]
    out = tmp_path / "out.html"
    assert run(["page", f"{folder}", "--out", f"{out}", *options]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line and not out.exists()


def test_runs_have_the_titles_that_are_given(finished, tmp_path):
    with pytest.raises(InputError, match="titles: 2 for 1 runs"):
        write_videos([finished], tmp_path / "page.html", titles=["one", "two"])
    page = write_videos([finished], tmp_path / "page.html", titles=["A <title>"]).read_text()
    assert "A &lt;title&gt;" in page and "of jelly</h2>" not in page


def test_a_report_shows_the_run_and_names_no_place_or_time(finished):
    page = (finished / "report.html").read_text()
    assert "a &lt;b&gt;ball&lt;/b&gt; of jelly" in page and str(finished.parent) not in page
    for told in ("motion.mp4", "contact_sheet.png", "timing.json", "jaxphys animate --config",
                 "jaxphys generate --config", "law fixed corotated", "Momentum"):  # fmt: skip
        assert told in page
    mark = (finished / ".jaxphys-run").read_text().splitlines()
    assert '"report.html"' in mark
    with pytest.raises(InputError, match="in the way"):
        other = finished.parent / "other"
        other.mkdir()
        (other / ".jaxphys-run").write_text(mark[0] + "\n")
        (other / "report.html").write_text("mine")
        animate(told_scene(), other, objects=(read_ply(finished / "gaussians.ply"),))
