"""A simulated rater goes through a study's page in a real browser."""

import json

import numpy as np
import pytest

from jaxphys.pipeline.video import VideoWriter
from jaxphys.study.answers import read_answers, read_key
from jaxphys.study.make import make_study
from tests.browsers import started, until

pytestmark = pytest.mark.slow
browser = pytest.fixture(scope="module")(started)


@pytest.fixture
def made(tmp_path):
    """A study of one thing by two methods, each clip a third of a second long."""
    for number, name in enumerate(("ours", "rival")):
        (tmp_path / name).mkdir()
        with VideoWriter(tmp_path / name / "motion.mp4", 64, 48, 24) as writer:
            for frame in range(8):
                writer.add(np.full((48, 64, 3), 20 * frame + 60 * number, np.uint8))
    value = {
        "items": [{"name": "a", "clips": {"ours": "ours", "rival": "rival"}, "prompt": "a <ball>"}],
        "questions": [
            {"name": "motion", "text": "It moves as it should."},
            {"name": "choice", "text": "Which moves better?", "kind": "pair"},
        ],
        "seats": 2,
        "traps": 1,
    }
    (tmp_path / "study.json").write_text(json.dumps(value))
    return make_study(tmp_path / "study.json", tmp_path / "out")


def begin(page, seat):
    page.locator("#seat").fill(str(seat))
    page.locator("#begin").click()


def answer(page, choice):
    """Plays every clip and answers; before, neither can be done."""
    assert page.locator("#next").is_disabled()
    assert page.locator("fieldset").evaluate("group => group.disabled")
    for clip in page.locator("video").all():
        clip.evaluate("video => video.play()")
    until(page, "!document.querySelector('fieldset').disabled")
    assert page.locator("#next").is_disabled()
    page.locator(f"input[value='{choice}']").check()
    page.locator("#next").click()


def test_one_question_a_page_until_a_file_is_saved(browser, made, tmp_path):
    key = read_key(made)
    context = browser.new_context(accept_downloads=True)
    context.set_offline(True)
    page = context.new_page()
    said, asked = [], []
    page.on("console", lambda line: said.append(line.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((made / "page/index.html").as_uri())
    begin(page, 9)
    assert "1 to 2" in page.locator("#place").inner_text()
    begin(page, 2)
    wanted = []
    for number, shown in enumerate(key.seats[1]):
        if number == 2:  # closed in the middle, and opened again
            page.reload()
            begin(page, 2)
        assert f"Page {number + 1} of 5" in page.locator("#place").inner_text()
        assert "a <ball>" in page.locator("#place").inner_text()
        assert page.locator("video").count() == len(shown.clips)
        choice = shown.wanted or (4 if len(shown.clips) == 1 else "left")
        if shown.wanted is not None and len(shown.clips) == 1:
            assert f"answer {choice}," in page.locator("#place").inner_text()
        answer(page, choice)
        wanted.append(choice)
    with page.expect_download() as download:
        page.locator("#save").click()
    download.value.save_as(tmp_path / "answers.json")
    (found,) = read_answers([tmp_path / "answers.json"], key)
    assert found.values == tuple(wanted) and found.seat == 1 and found.finished
    assert json.loads(page.locator("#result").input_value()) == json.loads(
        (tmp_path / "answers.json").read_text()
    )
    assert not said and all(url.startswith(("file:", "blob:null/")) for url in asked)
    context.close()
