"""A run's directory scored from its files, and what is said of files that are missing."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from jaxphys.cli.evaluate import evaluate as command
from jaxphys.core.errors import InputError
from jaxphys.evaluate.aesthetic import HEADS, load_head
from jaxphys.evaluate.clip_score import load_clip
from jaxphys.evaluate.frames import evenly_spaced, read_frames
from jaxphys.evaluate.report import as_text, evaluate, find_prompt
from jaxphys.pipeline.video import VideoWriter

HEAD_FILES = Path(__file__).parent / "golden"
FRAMES = 5


@pytest.fixture
def finished(tmp_path):
    """What a run leaves that is read here: the prompt and a video that grows brighter."""
    (tmp_path / "prompt.json").write_text(json.dumps({"original": "a hat", "refined": "a red hat"}))
    with VideoWriter(tmp_path / "motion.mp4", 64, 48, fps=24) as video:
        for brightness in np.linspace(0, 255, FRAMES):
            picture = np.full((48, 64, 3), brightness, np.uint8)
            picture[20:30, 20:40] = (255, 0, 0)
            video.add(picture)
    return tmp_path


@pytest.fixture(autouse=True)
def nothing_is_fetched(tmp_path_factory, monkeypatch):
    nowhere = str(tmp_path_factory.mktemp("none"))
    for name, value in (
        ("HF_HUB_OFFLINE", "1"),
        ("HF_HUB_CACHE", nowhere),
        ("JAXPHYS_WEIGHTS", nowhere),
    ):
        monkeypatch.setenv(name, value)


def test_a_run_is_scored_frame_by_frame(finished, clip_folder):
    result = evaluate(finished, clip=clip_folder, aesthetic=HEAD_FILES)
    assert json.loads((finished / "evaluation.json").read_text()) == result
    assert result["prompt"] == "a hat"
    assert result["frames"] == {"total": FRAMES, "scored": FRAMES}
    assert result["unavailable"] == {}

    clip = load_clip(clip_folder)
    embeddings = clip.pictures(read_frames(finished / "motion.mp4", clip.size))
    cosines = embeddings @ clip.texts(["a hat"])[0]
    assert cosines.std() > 1e-3
    np.testing.assert_allclose(result["clip"]["by_frame"], cosines, atol=1e-6)
    assert result["clip"]["cosine"] == pytest.approx(cosines.mean(), abs=1e-6)
    assert result["clip"]["score"] == pytest.approx(100 * np.maximum(cosines, 0).mean(), abs=1e-4)
    assert "not comparable" in result["clip"]["model"]
    for version in HEADS:
        scores = load_head(version, HEAD_FILES)(embeddings)
        np.testing.assert_allclose(result["aesthetic"][version]["by_frame"], scores, atol=1e-6)
        assert result["aesthetic"][version]["score"] == pytest.approx(scores.mean())
    text = as_text(result)
    assert '"a hat": 5 of 5 pictures' in text
    assert f"{result['clip']['cosine']:.4f}" in text
    assert "LAION aesthetic v2" in text


def test_frames_are_read_in_order(finished):
    brightness = read_frames(finished / "motion.mp4", 16)[:, 0].mean((1, 2))
    np.testing.assert_allclose(brightness, np.linspace(0, 255, FRAMES), atol=4)


def test_few_frames_are_spread_evenly(finished, clip_folder):
    everything = evaluate(finished, clip=clip_folder, aesthetic=HEAD_FILES)["clip"]["by_frame"]
    with pytest.raises(InputError, match=r"evaluation\.json: is there already; --overwrite"):
        evaluate(finished)
    options = {"clip": clip_folder, "aesthetic": HEAD_FILES, "overwrite": True}
    few = evaluate(finished, frames=3, **options)
    assert few["frames"] == {"total": FRAMES, "scored": 3}
    np.testing.assert_allclose(few["clip"]["by_frame"], everything[::2], atol=1e-6)
    assert evenly_spaced(4, None) == evenly_spaced(4, 9) == [0, 1, 2, 3]
    with pytest.raises(InputError, match="--frames: 0 must be at least 1"):
        evaluate(finished, clip=clip_folder, frames=0)


def test_another_prompt_scores_otherwise(finished, clip_folder):
    own, other = (
        evaluate(finished, clip=clip_folder, aesthetic=HEAD_FILES, prompt=prompt, overwrite=True)[
            "clip"
        ]["cosine"]
        for prompt in (None, "a rose")
    )
    assert abs(own - other) > 1e-3


def test_prompt_comes_from_either_file(finished):
    scene = {"generation": {"prompt": "a vase"}}
    (finished / "config.json").write_text(json.dumps(scene))
    assert find_prompt(finished) == "a hat"
    (finished / "prompt.json").unlink()
    assert find_prompt(finished) == "a vase"
    (finished / "config.json").write_text(json.dumps({"generation": None}))
    with pytest.raises(InputError, match=r"holds no prompt .* give --prompt"):
        find_prompt(finished)


def test_a_missing_head_is_named_beside_the_scores(finished, clip_folder, tmp_path, capsys):
    heads = tmp_path / "heads"
    heads.mkdir()
    shutil.copy(HEAD_FILES / HEADS["v1"][1], heads)
    assert command(finished, clip=clip_folder, aesthetic=heads) == 1
    printed = capsys.readouterr()
    assert "CLIP score" in printed.out and "aesthetic v1" in printed.out
    assert "aesthetic v2" not in printed.out
    (line,) = printed.err.splitlines()
    assert "aesthetic score v2" in line and HEADS["v2"][1] in line


def test_the_command_prints_json(finished, clip_folder, capsys):
    assert command(finished, clip=clip_folder, aesthetic=HEAD_FILES, json=True) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out) == json.loads((finished / "evaluation.json").read_text())
    assert printed.err == ""


def test_a_missing_clip_is_one_line_and_nothing_is_written(finished, tmp_path):
    for folder in (None, tmp_path / "nowhere"):
        with pytest.raises(InputError, match="clip-vit-large-patch14") as error:
            evaluate(finished, clip=folder)
        assert "\n" not in str(error.value)
    assert not (finished / "evaluation.json").exists()


def test_a_damaged_head_does_not_cost_the_score(finished, clip_folder, tmp_path):
    heads = Path(shutil.copytree(HEAD_FILES, tmp_path / "heads"))
    file = heads / HEADS["v2"][1]
    file.write_bytes(file.read_bytes()[:-40])
    result = evaluate(finished, clip=clip_folder, aesthetic=heads)
    assert set(result["aesthetic"]) == {"v1"}
    assert file.name in result["unavailable"]["v2"]


@pytest.mark.parametrize("kept", [0, 200, -60])
def test_a_damaged_video_is_named(finished, clip_folder, kept):
    video = finished / "motion.mp4"
    video.write_bytes(video.read_bytes()[:kept])
    with pytest.raises(InputError, match=r"motion.mp4: cannot be read as a video"):
        evaluate(finished, clip=clip_folder, aesthetic=HEAD_FILES)


def test_directories_that_are_no_runs_are_named(finished, tmp_path):
    with pytest.raises(InputError, match="nowhere: is no directory"):
        evaluate(tmp_path / "nowhere")
    (finished / "motion.mp4").unlink()
    with pytest.raises(InputError, match=r"motion.mp4: is missing; run generate or animate"):
        evaluate(finished)
