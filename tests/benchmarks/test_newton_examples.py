"""Newton's own examples: the problems as they are stated here and to Newton. No peer is needed."""

import numpy as np
import pytest

from benchmarks import newton_examples as suite
from benchmarks.newton_scenes import FRICTION, MIDDLE, TURN, beam, sand
from benchmarks.peers.protocol import Matter, turning
from jaxphys.mpm.materials.plasticity import friction_coefficient


def test_the_beam_has_the_size_of_the_example():
    example = beam()
    matter, points = example.matter, suite.places(example.state)
    assert len(points) == 61 * 13 * 13  # three a cell of 1/4 m, and one more along each edge
    np.testing.assert_allclose(np.ptp(points, axis=0), [300 / 61, 12 / 13, 12 / 13], rtol=1e-6)
    np.testing.assert_allclose(matter.mass.sum(), 5000.0, rtol=1e-6)
    held, turned = matter.boundaries
    assert (len(held["particles"]), len(turned["particles"])) == (2 * 169, 169)
    np.testing.assert_allclose(matter.position[held["particles"], 0].max(), 1.5 + 5 / 61, rtol=1e-6)
    np.testing.assert_allclose(turned["centre"][1:], 1.5 + 6 / 13, rtol=1e-6)
    # A whole turn in 1000 of Newton's steps.
    assert turned["spin"][0] * 1000 * example.step == pytest.approx(2 * np.pi)


def test_cells_of_half_the_size_have_the_same_matter_and_the_same_ends():
    one, other = beam(), beam(finer=2)
    np.testing.assert_array_equal(suite.places(one.state), suite.places(other.state))
    assert other.config.grid.spacing == one.config.grid.spacing / 2
    assert other.config.grid.extent[0] > 1.5 + 5 + 1
    ends = [[boundary.centre for boundary in x.model.boundaries] for x in (one, other)]
    np.testing.assert_array_equal(*ends)


def test_no_sand_starts_in_the_box_and_its_cone_is_newtons():
    example = sand(cell=0.4)
    matter = example.matter
    floor, box = matter.boundaries
    arm = abs(matter.position - box["centre"]) - box["half_size"]
    assert (arm.max(axis=1) > 0).all() and matter.position[:, 2].min() > floor["height"]
    # All others are there: 16^3 of them, and the box reaches 0.1 m into them.
    assert 0.9 * 16**3 < len(arm) < 16**3
    assert (matter.youngs_modulus == 1e15).all()
    # Half the squared deviator is at most (friction x pressure) squared.
    angle = example.model.parameters["friction_angle"][0]
    slope = 3 * friction_coefficient(np.float64(angle))
    assert slope / np.sqrt(2) == pytest.approx(FRICTION, rel=1e-6)


def test_what_newton_is_told_comes_back_as_it_was_saved(tmp_path):
    matter = sand(cell=0.5).matter
    matter.save(tmp_path / "p.npz")
    back = Matter.load(tmp_path / "p.npz")
    assert (back.options, back.material) == (matter.options, matter.material)
    floor, box = back.boundaries
    assert floor == matter.boundaries[0] and tuple(box["half_size"]) == (0.5, 2.0, 0.8)


def test_driven_particles_turn_about_their_axis():
    told = {"centre": [1.0, 2.0, 3.0], "spin": [TURN, 0.0, 0.0]}
    start = np.array([[4.0, 2.5, 3.0], [0.0, 2.0, 2.0]])
    place, velocity, gradient = turning(told, start, 250 / 240)  # a quarter of a turn
    np.testing.assert_allclose(place, [[4.0, 2.0, 3.5], [0.0, 3.0, 3.0]], atol=1e-12)
    expected = [[0.0, -0.5 * TURN, 0.0], [0.0, 0.0, TURN]]
    np.testing.assert_allclose(velocity, expected, atol=1e-12)
    np.testing.assert_allclose((place - told["centre"]) @ gradient.T, velocity, atol=1e-12)
    still = turning(told | {"spin": [0.0, 0.0, 0.0]}, start, 1.0)
    np.testing.assert_array_equal(still[0], start)
    assert not still[1].any()


def test_ends_of_a_small_beam_follow_their_path_and_the_rest_falls():
    example = beam("float64", steps=2, cell=0.5)
    start = suite.places(example.state)
    end, counts = suite.explicit(example)
    held, turned = (np.asarray(told["particles"]) for told in example.boundaries)
    after = suite.places(end)
    np.testing.assert_array_equal(after[held], start[held])
    # x <- x + dt spin x arm: a step turns by atan(dt spin) and stretches the arm.
    n, angle = counts["steps"], TURN * example.time / counts["steps"]
    arm = start[turned, 1:] - np.asarray(example.boundaries[1]["centre"])[1:]
    grown = (1 + 1j * angle) ** n * (arm[:, 0] + 1j * arm[:, 1])
    moved = after[turned, 1:] - start[turned, 1:] + arm
    np.testing.assert_allclose(moved[:, 0] + 1j * moved[:, 1], grown, atol=1e-12)
    np.testing.assert_allclose(after[turned, 0], start[turned, 0], atol=1e-12)
    # Next to nothing has reached the middle yet: it falls freely.
    middle = abs(start[:, 0] - np.median(start[:, 0])) < 1e-3
    fallen = (start - after)[middle, 2]
    np.testing.assert_allclose(fallen, 5 * example.time**2 * (1 + 1 / n), rtol=5e-3)


def test_distances_match_particles_of_the_beam_and_heaps_of_sand(monkeypatch):
    one = np.random.default_rng(0).normal(size=(50, 3))
    other = one + np.array([0.3, 0.0, 0.4])
    assert suite.distance("beam", one, other, 5.0) == pytest.approx(0.1)
    assert suite.distance("sand", one, other[::-1], 5.0) == pytest.approx(0.1)
    assert suite.distance("beam", one, other[::-1], 5.0) > 0.2
    # And what lines tell of an end: the whole beam turned by 0.3 and let down by 0.1.
    example = beam(cell=0.5)
    start = suite.places(example.state)
    monkeypatch.setattr(suite, "reference", lambda *_, **__: start)
    middle, (c, s) = start.mean(axis=0), (np.cos(0.3), np.sin(0.3))
    end = middle + (start - middle) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
    found = suite.measures("beam", {"cell": 0.5}, end - [0, 0, 0.1])
    assert found["turned"] == pytest.approx(np.degrees(0.3))
    assert found["sunk"] == pytest.approx(0.1)
    assert found["error_finer"] == pytest.approx(found["moved"]) and found["moved"] > 0.02
    heap = suite.places(sand(cell=0.4).state)
    heap[:, 2] = MIDDLE[2] + 0.5
    found = suite.measures("sand", {"cell": 0.4}, heap)
    assert found["height"] == pytest.approx(0.5) and found["top"] == pytest.approx(0.5)
    assert found["on_box"] == 0
    assert -1.1 < found["left"] < -0.9 and 0.9 < found["right"] < 1.1 > found["front"] > 0.9


def test_a_run_of_no_time_compiles_and_a_line_tells_of_the_run(monkeypatch):
    """The method here: everything falls freely."""

    def falling(example):
        fallen = example.state.position.at[2].add(-5 * example.time**2)
        return example.state._replace(position=fallen), {"steps": example.steps}

    size = {"steps": 12, "cell": 0.5}
    start = suite.places(beam(**size).state)
    monkeypatch.setitem(suite.RUNS, "jaxphys", lambda example: suite.ours(falling, example))
    monkeypatch.setattr(suite, "reference", lambda *_, **__: start)
    run = suite.prepared("beam", size, "jaxphys")
    run.call()
    assert run.once and run.work == pytest.approx(0.05)
    assert run.error() == pytest.approx(5 * 0.05**2 / 5, rel=1e-5)
    found = run.found()
    assert found["steps"] == 12 and found["sunk"] == pytest.approx(5 * 0.05**2, rel=1e-5)
