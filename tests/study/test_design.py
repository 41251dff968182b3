"""Everything is shown equally often, on both sides, and no page tells a method's name."""

import json
import re
from collections import Counter

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.study.design import assigned
from jaxphys.study.make import make_study
from jaxphys.study.study_page import blinded, study_page
from tests.study.simulated import METHODS, study


@pytest.mark.parametrize("ratings", [None, 1, 5, 7])
@pytest.mark.parametrize("items", [1, 4, 6])
def test_trials_sides_and_methods_are_balanced(items, ratings):
    given = study(items=items, seats=17, ratings=ratings, pairs=ratings, seed=items)
    seats = assigned(given)
    for number in range(2):
        shown = [page for pages in seats for page in pages
                 if page.question == number and page.wanted is None]  # fmt: skip
        trials = Counter(tuple(sorted(page.clips)) for page in shown)
        assert len(trials) <= 3 * items and max(trials.values()) - min(trials.values()) <= 1
        if len(shown) >= 3 * items:
            assert len(trials) == 3 * items
        sides = Counter(page.clips for page in shown)
        for clips in trials:
            assert abs(sides[clips] - sides[clips[::-1]]) <= 1
        for pages in seats:
            own = [page for page in pages if page.question == number and page.wanted is None]
            assert len({tuple(sorted(page.clips)) for page in own}) == len(own)
            methods = Counter(m for page in own for _, m in page.clips)
            counts = [methods[m] for m in range(len(METHODS))]
            assert max(counts) - min(counts) <= 2


def test_traps_are_there_and_never_first_and_orders_differ():
    given = study(seats=8, traps=3)
    seats = assigned(given)
    for pages in seats:
        traps = [page for page in pages if page.wanted is not None]
        assert len(traps) == 6 and pages[0].wanted is None
        assert all(one.clips[0] == one.clips[-1] for one in traps)
        assert sum(one.wanted == "same" for one in traps) == 3
    assert len({tuple(pages) for pages in seats}) == 8
    assert assigned(given) == seats != assigned(study(seats=8, traps=3, seed=1))


def test_a_page_names_no_method_and_no_address():
    given = study(seats=5)
    page = study_page(given, assigned(given), "abc")
    assert not any(re.search(rf"\b{name}\b", page, re.IGNORECASE) for name in METHODS)
    assert "thing 1" not in page and "a thing, number 1" in page  # items' names may tell too
    assert not re.search(r"(?i)(https?|wss?|ftp)://", page)
    assert "default-src &#x27;none&#x27;" in page and "unsafe" not in page
    names = blinded(given)
    assert len(set(names.values())) == 12
    by_method = [[int(re.sub(r"\D", "", names[i, m])[:4]) for i in range(4)] for m in range(3)]
    assert all(np.ptp(numbers) > 3 for numbers in by_method)  # no method's clips come in a row
    data = json.loads(re.search(r'id="study">(.*?)</script>', page)[1])
    assert not any("wanted" in entry for seat in data["seats"] for entry in seat)


@pytest.fixture
def config(tmp_path):
    """Writes a study's file and its clips."""

    def write(**changes):
        items = []
        for i in range(2):
            clips = {}
            for name in METHODS:
                path = tmp_path / "clips" / name / f"{i}.mp4"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(f"{name} {i}".encode())
                clips[name] = f"clips/{name}/{i}.mp4"
            items.append({"name": f"thing {i}", "clips": clips, "prompt": "a <b>thing"})
        value = {
            "items": items,
            "questions": [{"name": "motion", "text": "Which moves better?", "kind": "pair"}],
            "seats": 3,
        }
        (tmp_path / "study.json").write_text(json.dumps(value | changes))
        return tmp_path / "study.json"

    return write


def test_the_command_makes_a_folder_to_hand_out_and_a_key(config, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["study", "make", f"{config()}", "--out", f"{out}"]) == 0
    assert "stays with you" in capsys.readouterr().out
    key = json.loads((out / "key.json").read_text())
    assert key["methods"] == sorted(METHODS)
    given = {path.name: path.read_bytes() for path in (out / "page/clips").iterdir()}
    assert sorted(given.values()) == sorted(
        f"{name} {i}".encode() for name in METHODS for i in range(2)
    )
    handed = (out / "page/index.html").read_text()
    assert not any(re.search(rf"\b{name}\b", handed) for name in METHODS)
    assert "<b>thing" not in handed
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert make_study(tmp_path / "study.json", out) == out
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert run(["study", "make", f"{config(seed=1)}", "--out", f"{out}"]) == 2
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"title": "Is Ours better?"}, "'ours'"),
        ({"questions": []}, "at least one"),
        ({"questions": [{"name": "a", "text": "b", "kind": "rank"}]}, "'rank'"),
        ({"items": [{"name": "a", "clips": {"x": "none.mp4", "y": "none.mp4"}}]}, "none.mp4"),
        ({"items": [{"name": "a", "clips": {"x": "clips/ours/0.mp4"}}]}, "two methods"),
        ({"items": [{"name": "a", "clips": {"x": "p"}}, {"name": "b", "clips": {}}]}, "every"),
        ({"seats": 0}, "seats"),
        ({"rater": 3}, "rater"),
    ],
)
def test_what_is_no_study_is_refused_in_a_line(config, tmp_path, capsys, changes, words):
    out = tmp_path / "out"
    assert run(["study", "make", f"{config(**changes)}", "--out", f"{out}"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line and not out.exists()
