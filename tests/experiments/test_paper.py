"""The paper's evaluation: what each configuration changes, tables of numbers made by hand, and that
what is done is not done again.
"""

import json
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from experiments import lines
from experiments.paper import ablation, films, guided, measures, objects
from experiments.paper.__main__ import cases, main, tables
from experiments.paper.methods import DREAM, FEATURE, OURS, scene_for
from experiments.paper.objects import MAKINGS, Making, config_of, prompt_of
from experiments.paper.run import FULL, QUICK, Run
from experiments.paper.things import MAIN, SHOWN, SUPPLEMENT
from jaxphys.gaussians.gaussians import from_points
from jaxphys.guidance.diffusion.score_distillation import Distillation
from jaxphys.scene import Domain, Object, Scene
from jaxphys.scene.build import build
from jaxphys.scene.json import to_json


def differing(one, other, where: str = "") -> set[str]:
    """The fields in which two JSON values differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        found = set()
        for name in one.keys() | other.keys():
            found |= differing(one.get(name), other.get(name), f"{where}.{name}".strip("."))
        return found
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return set().union(*(differing(a, b, where) for a, b in zip(one, other, strict=True)))
    return set() if one == other else {where}


@pytest.mark.parametrize("title", SHOWN)
def test_methods_differ_from_ours_in_what_they_say(title):
    shown = SHOWN[title]
    ours = to_json(scene_for(OURS, shown))
    assert (ours["width"], ours["height"], ours["regularise_colours"]) == (1958, 1090, True)
    dream = to_json(scene_for(DREAM, shown, stiffness=123.0))
    assert differing(ours, dream) == {
        "width",
        "height",
        "regularise_colours",
        "objects.parameters.youngs_modulus",
    }
    feature = scene_for(FEATURE, shown)
    assert differing(ours, to_json(feature)) == {"width", "height", "domain.spacing"}
    assert max(feature.domain.shape) == 32
    assert DREAM.knows(shown) and FEATURE.knows(shown) == (shown.material in ("elastic", "sand"))


def test_ablations_differ_from_ours_in_what_they_say():
    ours = Making()
    assert MAKINGS["ours"] == ours
    assert config_of(Making(refined=False, wordy=True)) == config_of(ours)
    without = config_of(MAKINGS["without 3D guidance"])
    assert differing(vars(config_of(ours)), vars(without)) == {"stages"}
    for one, other in zip(config_of(ours).stages, without.stages, strict=True):
        assert differing(vars(one), vars(other)) <= {"shape"} and not other.shape
    assert config_of(MAKINGS["without the 3D prior"]) == without
    assert prompt_of("can", ours).startswith("a can, upright metal cylinder")
    assert prompt_of("can", MAKINGS["without refinement"]) == "a can"
    wordy = prompt_of("can", MAKINGS["without refinement, wordy sentence"])
    assert "kitchen" in wordy
    # So that the wordy sentence without refinement has ours as its pair.
    assert prompt_of("can", Making(wordy=True)) == prompt_of("can", ours)


def test_a_start_without_the_prior_fills_a_ball():
    points, colours = objects.FromBall(None).sample(jax.random.key(0), 4000)
    radius = np.linalg.norm(points, axis=1)
    assert radius.max() <= 0.5 and np.all(np.asarray(colours) == 0.5)
    # Uniform: a half of the volume lies within the cube root of a half.
    assert np.mean(radius < 0.5 * 0.5 ** (1 / 3)) == pytest.approx(0.5, abs=0.03)
    assert np.linalg.norm(points.mean(axis=0)) < 0.02


def test_differences_have_the_interval_of_paired_objects():
    """Against scipy: means over seeds first, then Student's t over objects."""
    random = np.random.default_rng(0)
    ours = {(name, seed): random.normal() for name in "abcdef" for seed in (0, 1)}
    without = {cell: value - random.normal(0.3, 1.0) for cell, value in ours.items()}
    found = ablation.difference(ours, without | {("other", 0): 1.0})
    means = [np.mean([ours[n, s] - without[n, s] for s in (0, 1)]) for n in "abcdef"]
    interval = stats.ttest_1samp(means, 0).confidence_interval()
    assert found.mean == pytest.approx(np.mean(means))
    assert (found.low, found.high) == pytest.approx(tuple(interval), rel=1e-4)
    assert (found.objects, found.pairs) == (6, 12)


@pytest.mark.parametrize(
    ("ends", "better", "said"),
    [
        ((0.1, 0.3), 1, "the paper's"),
        ((0.1, 0.3), -1, "**the reverse**"),
        ((-0.3, -0.1), -1, "the paper's"),
        ((-0.1, 0.3), 1, "**not shown**"),
        ((0.0, 0.0), 1, "**no difference at all**"),
    ],
)
def test_the_order_is_told_by_the_interval(ends, better, said):
    assert ablation.order(ablation.Difference(sum(ends) / 2, *ends, 3, 3), better) == said


def test_one_object_has_no_interval():
    found = ablation.difference({("can", 0): 1.0, ("can", 1): 3.0}, {("can", 0): 0.0})
    assert found.mean == 1 and (found.objects, found.pairs) == (1, 1)
    assert ablation.order(found, 1) == "one object: no interval"


def object_line(name: str, seed: int, how: str, regular: float, raw: float) -> dict:
    found = {"first": 1.0, "saturation": 0.5, "distance": 0.1}
    return {
        "case": ablation.object_case(name, seed, how),
        **{"status": "ok", "object": name, "seed": seed, "how": how, "size": "quick"},
        **{"regular": found | {"cosine": regular}, "raw": found | {"cosine": raw}},
        **{"processor": "Abacus", "cores": 2, "seconds": 60.0},
    }


def film_line(method: str, title: str, cosine: float, **more) -> dict:
    return {
        "case": f"film: {method}: {title}",
        **{"status": "ok", "method": method, "title": title, "size": "quick", "frames": 8},
        **{"material": SHOWN[title].material, "resolution": "20x10", "nodes": [8, 9, 10]},
        **{"spent": [90.0, 120.0], "resumed": False, "cosine": cosine},
        **{"saturation": 0.5, "change": 2.0, "processor": "Abacus", "cores": 2, **more},
    }


def test_tables_are_made_of_lines():
    made = [
        film_line("ours", "metal can", 0.2),
        film_line("ours", "jelly pancakes", 0.4, resumed=True, spent=[1.0, 1.0]),
        film_line("DreamPhysics-like", "metal can", 0.1, moduli=[1e6, 2e6], clip=0.25),
        *(object_line(name, 0, "ours", 0.5, 0.4) for name in ("can", "rose")),
        *(object_line(name, 0, "without refinement", 0.3, 0.3) for name in ("can", "rose")),
        {"case": "film: ours: x", "status": "failed", "reason": "it broke"}
        | {"processor": "Abacus", "cores": 2},
    ]
    text = tables(made)
    assert "Failed: film: ours: x: it broke" in text and "2 cores of Abacus" in text
    assert "| metal can | *a can* | metal | 20x10 | 8 | 8x9x10 | 1.50 (2.00) |" in text
    assert (
        "| jelly pancakes | *a stack of pancakes* | jelly | 20x10 | 8 | 8x9x10 | resumed |" in text
    )
    # Means of both films; seconds of the one that was not stopped.
    assert "| **ours**, here | 2 | no weights | no weights | 0.300 |" in text
    assert "| 20x10 | 1.50 (2.00) |" in text
    assert "| DreamPhysics, the paper's |  | 3.77 | 0.269 |  |  |  | 800x800 | 3.58 |" in text
    assert "| **DreamPhysics-like**, here | 1 | no weights | 0.250 | 0.100 |" in text
    assert "0.2 / 0.1 / -" in text and "1e+06 to 2e+06" in text
    assert (
        "| without refinement | cosine | 0.500 | 0.300 | +0.200 [+0.200, +0.200] | 2, 2 |" in text
    )
    assert "| without colour regularisation | cosine | 0.500 | 0.400 | +0.100" in text
    assert "without 3D guidance" not in text


def test_everything_is_run_once_and_ours_first():
    every = list(cases(Run(None, FULL)))
    assert len(every) == len(set(every))
    assert len(MAIN) == len(SUPPLEMENT) == 5 and {t.material for t in MAIN.values()} == {
        t.material for t in SUPPLEMENT.values()
    }
    assert len(FULL.ablated) >= 12 and len(FULL.seeds) == 2
    assert len([c for c in every if c.startswith("object: ")]) == 12 * 2 * len(MAKINGS)
    assert len([c for c in every if c.startswith("film: ours")]) == 10
    assert len([c for c in every if c.startswith("film: Feature")]) == 4
    quick = list(cases(Run(None, QUICK)))
    assert quick[0].startswith("object: ") and any(c.startswith("film: Feature") for c in quick)


def test_what_is_done_is_not_done_again(tmp_path, monkeypatch):
    """Killed in the third object, the run makes that one again and no other."""
    made, killed = [], []

    def make(name, seed, making, steps):
        made.append((name, seed, making))
        if len(made) == 3 and not killed:
            killed.append(made.pop())
            raise KeyboardInterrupt
        return from_points(np.eye(3, dtype=np.float32), np.eye(3, dtype=np.float32), 0.1)

    monkeypatch.setattr(objects, "make", make)
    monkeypatch.setattr(measures, "of_object", lambda thing, name: {"cosine": float(thing.count)})
    monkeypatch.setattr(measures, "regular", lambda thing: thing)
    monkeypatch.setattr(ablation, "MEASURES", {"cosine": 1})
    arguments = ["--out", str(tmp_path), "--quick", "--only", "object: burger"]
    with pytest.raises(KeyboardInterrupt):
        main(arguments)
    assert len(lines.read(tmp_path / "quick" / "lines.jsonl")) == 2
    main(arguments)
    main(arguments)
    assert [making for *_, making in made] == list(MAKINGS.values())
    assert killed[0] == made[2]
    assert len(lines.read(tmp_path / "quick" / "lines.jsonl")) == len(MAKINGS)
    assert "| without refinement | cosine | 3.000 |" in (tmp_path / "quick/tables.md").read_text()


class Judge(NamedTuple):
    """A guide of small pictures that likes them bright by so much."""

    by: float

    @property
    def resolution(self) -> int:
        return 16

    def distil(self, images, azimuth, elevation, key, config, progress):
        value = self.by * jnp.sum(images)
        return Distillation(value, images, images, azimuth)


@pytest.mark.slow
def test_guidance_moves_the_modulus_by_what_the_guide_says():
    """Adam's first step is its rate whatever the slope; a guide that says nothing moves nothing,
    and one that says the opposite moves it the other way.
    """
    line = np.linspace(-0.5, 0.5, 4)
    places = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    thing = from_points(places.astype(np.float32), np.full((64, 3), 0.9, np.float32), 0.15)
    block = Object(material="jelly", size=0.4, centre=(0.5, 0.5, 0.5), filling=None)
    scene = Scene(objects=(block,), domain=Domain((1.0, 1.0, 1.0), 0.1))
    simulation, look = build(scene, thing)
    simulation = simulation.with_(deformation=1.2 * np.eye(3))
    search = guided.Search(steps=1, rate=0.25, moments=1)

    def found(by: float) -> list[float]:
        given = {"seconds": 0.02, "size": 0.4, "search": search}
        return guided.stiffness(simulation, look, Judge(by), 1e4, **given)

    assert found(0.0) == [1e4, pytest.approx(1e4)]
    up, down = found(1.0)[1], found(-1.0)[1]
    assert sorted([up, down]) == pytest.approx(1e4 * np.exp([-0.25, 0.25]), rel=1e-3)


def test_saturation_is_that_of_what_is_coloured():
    grey = np.full((8, 8, 3), 0.7)
    assert measures.saturation(grey) == 0
    grey[:2] = (0.8, 0.4, 0.4)
    assert measures.saturation(grey) == pytest.approx(0.5)


def test_shapes_are_as_far_as_their_points():
    line = np.arange(3.0)
    lattice = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    assert measures.chamfer(lattice, lattice) == 0
    assert measures.chamfer(lattice, lattice + np.array([0.0, 0.0, 0.25])) == pytest.approx(0.25)
    assert measures.chamfer(lattice[:0], lattice) == np.inf
    # One way 0, the other way the mean distance of what has no neighbour.
    far = np.concatenate([lattice, [[0.0, 0.0, 30.0]]])
    assert measures.chamfer(lattice, far) == pytest.approx(28 / 28 / 2)


def test_a_kind_is_nearer_to_itself_than_to_another():
    from jaxphys.guidance.library import library_object

    can, _ = library_object("a can", seed=5, count=1000)
    assert measures.shape_distance(can, "can") < 0.6 * measures.shape_distance(can, "rose")


def test_regular_colours_are_normalised_by_the_brightest_and_clamped():
    colours = np.array([[2.0, 1.0, 0.5], [0.0, -0.4, 1.0]], np.float32)
    thing = from_points(np.eye(3, dtype=np.float32)[:2], colours, 0.1)
    found = 0.5 + 0.28209479177387814 * np.asarray(measures.regular(thing).harmonics[:, 0])
    assert found == pytest.approx(np.array([[1.0, 0.5, 0.25], [0.0, 0.0, 0.5]]), abs=1e-6)


def test_the_page_that_is_shipped_holds_the_tables_of_the_lines_that_are_shipped():
    root = Path(__file__).parents[2]
    found = lines.read(root / "benchmarks" / "lines" / "paper-quick.jsonl")
    assert tables(found) in (root / "docs" / "paper_results.md").read_text()
    assert json.dumps(found)  # and there are some
    assert any(films.OURS.name == line.get("method") for line in found)
