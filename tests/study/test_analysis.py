"""Simulated raters of a known truth: it is found, intervals hold it as often as they say, and what
is no answer is refused."""

import json
import math

import numpy as np
import pytest

from jaxphys.cli.main import run
from jaxphys.core.errors import InputError
from jaxphys.study.analysis import SIMULATED, analyse
from jaxphys.study.bradley_terry import Comparisons, NoFiniteStrength, strengths
from jaxphys.study.statistics import clustered_means, student_quantile
from tests.study.simulated import METHODS, Raters, files_of, study

STRENGTHS = np.array([0.5, -0.1, -0.4])
QUALITY = np.array([3.8, 3.0, 2.4])


def binomial_bounds(count, chance, outside=1e-3):
    """The least and the greatest number that such counts lie between but for `outside`."""
    steps = np.arange(1, count + 1)
    logarithms = np.concatenate([[0], np.cumsum(np.log(count - steps + 1) - np.log(steps))])
    ways = logarithms + np.arange(count + 1) * math.log(chance)
    share = np.cumsum(np.exp(ways + np.arange(count, -1, -1) * math.log(1 - chance)))
    return int(np.searchsorted(share, outside / 2)), int(np.searchsorted(share, 1 - outside / 2))


def test_binomial_bounds_and_student():
    assert binomial_bounds(10, 0.5, outside=0.02) == (1, 9)
    assert binomial_bounds(200, 0.95) == (179, 198)
    for freedom, wanted in ((1, 12.7062), (2, 4.30265), (9, 2.26216), (29, 2.04523)):
        assert student_quantile(0.975, freedom) == pytest.approx(wanted, rel=2e-4)
        assert student_quantile(0.5, freedom) == pytest.approx(0, abs=1e-9)


def test_simulated_raters_of_a_known_truth_are_found_out(tmp_path, capsys):
    given = study(items=6, seats=60, seed=3)
    paths = files_of(tmp_path, given, Raters(0, QUALITY, STRENGTHS))
    names = given.methods  # sorted: their numbers are in this order
    result = analyse(tmp_path, paths)
    assert result["simulated"] and result["raters"] == {"files": 60, "kept": 60, "excluded": {}}
    means = result["questions"]["rating of motion"]["means"]
    found = result["questions"]["pair of motion"]
    for number, name in enumerate(names):
        assert abs(means[name]["value"] - QUALITY[number]) < 0.25
        assert means[name]["low"] < means[name]["value"] < means[name]["high"]
        assert means[name]["answers"] == 60 * 6
        assert abs(found["strengths"][name]["value"] - STRENGTHS[number]) < 0.35
    assert 0.4 < found["left_chosen"] < 0.6
    assert sum(sum(pair["wins"]) for pair in found["wins"]) == 60 * 18
    assert run(["study", "analyse", f"{tmp_path}", *map(str, paths)]) == 0
    told = capsys.readouterr().out
    assert told.startswith(SIMULATED) and "raters as clusters" in told
    assert run(["study", "analyse", f"{tmp_path}", *map(str, paths), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == result


def test_intervals_of_means_hold_the_truth_as_often_as_they_say():
    studies, raters, items = 300, 12, 5
    crowd = Raters(1, QUALITY, STRENGTHS, most=1_000_000)
    truth = [crowd.ratings(np.arange(1_000_000), method).mean() for method in range(3)]
    holds, apart, plain = np.zeros(3), 0, 0
    who, methods = (part.ravel() for part in np.indices((raters, 3 * items)))
    methods = methods % 3
    for number in range(studies):
        values = Raters([2, number], QUALITY, STRENGTHS).ratings(who, methods).astype(float)
        estimates = clustered_means(values, methods, who, 3)
        for method in range(3):
            _, low, high = estimates.interval(np.eye(3)[method])
            holds[method] += low <= truth[method] <= high
        _, low, high = estimates.interval(np.array([1.0, -1.0, 0.0]))
        apart += low <= truth[0] - truth[1] <= high
        first = values[methods == 0]
        plain += abs(first.mean() - truth[0]) < 1.96 * first.std(ddof=1) / np.sqrt(first.size)
    least, most = binomial_bounds(studies, 0.95)
    assert all(least <= count <= most for count in (*holds, apart))
    assert plain < least  # which is why raters are clusters


def test_intervals_of_strengths_hold_the_truth_as_often_as_they_say():
    studies, raters, items = 300, 20, 5
    pairs = np.array([(0, 1), (0, 2), (1, 2)])
    holds = np.zeros(3)
    who, which = (part.ravel() for part in np.indices((raters, 3 * items)))
    first, second = pairs[which % 3].T
    for number in range(studies):
        told = Raters([3, number], QUALITY, STRENGTHS, stubborn=0.7).wins(who, first, second)
        given = Comparisons(first, second, told.astype(float), who)
        estimates = strengths(given, list(METHODS))
        assert estimates.values.sum() == pytest.approx(0, abs=1e-9)
        for method in range(3):
            _, low, high = estimates.interval(np.eye(3)[method])
            holds[method] += low <= STRENGTHS[method] <= high
    least, most = binomial_bounds(studies, 0.95)
    assert all(least <= count <= most for count in holds)


def comparisons(*rows):
    first, second, share = (np.array(column) for column in zip(*rows, strict=True))
    return Comparisons(first, second, share.astype(float), np.arange(len(rows)))


def test_two_methods_have_the_strengths_of_their_odds_and_ties_are_half_a_win():
    given = comparisons(*[(0, 1, 1)] * 6, *[(1, 0, 1)] * 2, (0, 1, 0.5), (1, 0, 0.5))
    values = strengths(given, ["a", "b"]).values
    assert values[0] - values[1] == pytest.approx(math.log(7 / 3))


def test_what_no_comparison_joins_is_refused_and_what_never_lost_has_no_strength():
    apart = comparisons((0, 1, 1), (1, 0, 1), (2, 3, 1), (3, 2, 1))
    with pytest.raises(InputError, match="no comparison leads from a, b to c, d"):
        strengths(apart, list("abcd"))
    beaten = comparisons((0, 1, 1), (1, 2, 1), (2, 1, 1), (0, 2, 1))
    with pytest.raises(NoFiniteStrength, match=r"^a never lost"):
        strengths(beaten, list("abc"))


def test_a_study_that_falls_apart_is_refused(tmp_path, capsys):
    given = study(items=1, seats=2, kinds=("pair",), pairs=1)
    paths = files_of(tmp_path, given, Raters(0, QUALITY, STRENGTHS))
    assert run(["study", "analyse", f"{tmp_path}", f"{paths[0]}"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "no comparison is left of" in line


def test_who_never_loses_is_told_by_counts(tmp_path):
    given = study(items=3, seats=6, kinds=("pair",))
    paths = files_of(tmp_path, given, Raters(0, QUALITY, np.array([60.0, 0.0, 0.1])))
    found = analyse(tmp_path, paths)["questions"]["pair of motion"]
    assert found["unavailable"].startswith(f"{given.methods[0]} never lost")
    assert "strengths" not in found and sum(sum(one["wins"]) for one in found["wins"]) == 54


def test_traps_exclude_the_careless_and_only_them(tmp_path):
    given = study(items=3, seats=8)
    paths = files_of(
        tmp_path, given, Raters(0, QUALITY, STRENGTHS), careless=(2, 5), unfinished=(7,)
    )
    result = analyse(tmp_path, paths)
    assert result["raters"]["excluded"] == {
        "3": "failed 4 traps", "6": "failed 4 traps", "8": "did not finish"
    }  # fmt: skip
    assert result["raters"]["kept"] == 5
    assert result["questions"]["rating of motion"]["answers"] == 5 * 9
    assert analyse(tmp_path, paths, failures=4)["raters"]["kept"] == 7
    with pytest.raises(InputError, match=r"nobody is left.*seat 3 failed 4 traps"):
        analyse(tmp_path, [paths[2]])
    one = analyse(tmp_path, [paths[0]])["questions"]["rating of motion"]["means"]
    assert all(value["low"] is None for value in one.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "x"}, "format"),
        ({"version": 2}, "version"),
        ({"study": "another"}, "study"),
        ({"seat": 99}, "seat: 99"),
        ({"seat": True}, "seat"),
        ({"finished": "yes"}, "finished"),
        ({"answers": {}}, "answers"),
        ({"answers": [{"page": 0, "answer": 6}]}, "answers[0].answer: 6"),
        ({"answers": [{"page": 0, "answer": "up"}]}, "answers[0].answer: 'up'"),
        ({"answers": [{"page": 0, "answer": [1]}]}, "answers[0].answer"),
        ({"answers": [{"page": 0, "answer": True}]}, "answers[0].answer"),
        ({"answers": [{"page": 1, "answer": 3}]}, "answers[0]"),
        ({"answers": [{"page": 0}]}, "answers[0]"),
        ({"answers": [7]}, "answers[0]"),
        (None, "not valid JSON"),
    ],
)
def test_what_is_no_answer_is_refused_in_a_line(tmp_path, capsys, change, words):
    given = study(items=2, seats=2)
    path, other = files_of(tmp_path, given, Raters(0, QUALITY, STRENGTHS))
    if change is None:
        path.write_text("{")
    else:
        path.write_text(json.dumps(json.loads(path.read_text()) | change))
    assert run(["study", "analyse", f"{tmp_path}", f"{path}", f"{other}"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert words in line and "simulated-1.json" in line


def test_one_seat_twice_and_no_key_are_refused(tmp_path, capsys):
    given = study(items=2, seats=2)
    path, _ = files_of(tmp_path, given, Raters(0, QUALITY, STRENGTHS))
    assert run(["study", "analyse", f"{tmp_path}", f"{path}", f"{path}"]) == 2
    assert "a seat is one rater's" in capsys.readouterr().err
    assert run(["study", "analyse", f"{tmp_path / 'none'}", f"{path}"]) == 2
    assert "key.json: no such file" in capsys.readouterr().err
    (tmp_path / "key.json").write_text(
        json.dumps(json.loads((tmp_path / "key.json").read_text()) | {"seats": [[{}]]})
    )
    assert run(["study", "analyse", f"{tmp_path}", f"{path}"]) == 2
    assert "is damaged" in capsys.readouterr().err
