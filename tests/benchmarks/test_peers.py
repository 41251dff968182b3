"""Peers in environments of their own: the worker protocol, by a peer that needs none.

The peer here flies freely: x + v t, by steps; so its answer is known.
"""

import dataclasses
import sys

import numpy as np
import pytest

from benchmarks import worker
from benchmarks.harness import run_suite
from benchmarks.peers.protocol import Matter
from benchmarks.peers.remote import GENESIS, NEWTON, Peer, PeerError, Session

VARIABLE = "JAXPHYS_TEST_PEER_PYTHON"
WORKER = """
import os, sys
import numpy as np
from benchmarks.peers.protocol import Simulation, serve

assert "jax" not in sys.modules
print("the peer's own chatter")

def build(matter):
    if matter.law == "unknown":
        raise ValueError("law: there is\\nno such law")
    if matter.law == "crash":
        os._exit(3)
    x = matter.position.copy()
    def reset():
        x[:] = matter.position
    def advance():
        if matter.law == "slow":
            import time; time.sleep(60)
        for _ in range(matter.steps):
            x[:] += matter.dt * matter.velocity
    end = lambda: (x, matter.velocity, matter.affine, matter.deformation)
    return Simulation(reset, advance, end, matter.steps, "none", {"flier": "1.0"})

serve(build)
"""


@pytest.fixture
def flier(tmp_path, monkeypatch):
    """A peer of this interpreter's, whose module lies in a folder that only the peer sees."""
    (tmp_path / "flier_worker.py").write_text(WORKER)
    script = tmp_path / "python"
    script.write_text(f'#!/bin/sh\nPYTHONPATH={tmp_path} exec {sys.executable} "$@"\n')
    script.chmod(0o755)
    monkeypatch.setenv(VARIABLE, str(script))
    return Peer("flier", VARIABLE, "flier_worker", "nothing")


def matter(count=5, **changes) -> Matter:
    """Some particles."""
    random = np.random.default_rng(0)
    values = {
        "position": random.normal(size=(count, 3)),
        "velocity": random.normal(size=(count, 3)),
        "affine": random.normal(size=(count, 3, 3)),
        "deformation": np.eye(3) + 0.1 * random.normal(size=(count, 3, 3)),
        "mass": random.uniform(1, 2, count),
        "volume": random.uniform(1, 2, count),
        "youngs_modulus": np.full(count, 1e5),
        "poisson_ratio": np.full(count, 0.3),
        "spacing": 0.1,
        "nodes": (8, 9, 10),
        "dt": 0.01,
        "steps": 7,
        "gravity": (0.0, 0.0, -9.81),
        "options": {"tolerance": 1e-4},
    }
    return Matter(**(values | changes))


def test_a_problem_comes_back_as_it_was_saved(tmp_path):
    told = matter(law="Hencky")
    told.save(tmp_path / "p.npz")
    back = Matter.load(tmp_path / "p.npz")
    for field in dataclasses.fields(Matter):
        one, other = getattr(told, field.name), getattr(back, field.name)
        assert type(one) is type(other)
        assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other


def test_a_peer_runs_from_the_start_each_time_and_tells_its_end(flier):
    told = matter()
    with Session(flier) as session:
        session.load(told)
        assert session.ready["steps"] == 7 and session.ready["versions"]["flier"] == "1.0"
        for _ in range(2):
            assert session.run()["seconds"] >= 0
        end = session.end()
        assert "chatter" in session.said
    np.testing.assert_allclose(end["position"], told.position + 0.07 * told.velocity, atol=1e-12)
    np.testing.assert_array_equal(end["deformation"], told.deformation)


@pytest.mark.parametrize(
    "law, line",
    [("unknown", "flier: ValueError: law: there is no such law"), ("crash", "flier: exit 3: ")],
)
def test_what_a_peer_ends_in_is_one_line(flier, law, line):
    with Session(flier) as session:
        with pytest.raises(PeerError) as caught:
            session.load(matter(law=law))
        if law == "unknown":  # and it can be asked again
            session.load(matter())
            assert session.run()["status"] == "ok"
        assert session.alive == (law == "unknown")
    assert str(caught.value).startswith(line) and "\n" not in str(caught.value)


def test_a_peer_that_takes_too_long_is_ended(flier):
    with Session(flier, limit=2.0) as session:
        session.load(matter(law="slow"))
        with pytest.raises(PeerError, match="no answer within 2 s"):
            session.run()


def test_a_missing_peer_is_a_status_and_not_a_crash(monkeypatch):
    monkeypatch.delenv(GENESIS.variable, raising=False)
    monkeypatch.setenv(NEWTON.variable, "/nowhere/python")
    assert "JAXPHYS_GENESIS_PYTHON is not set" in GENESIS.missing
    assert "JAXPHYS_NEWTON_PYTHON names /nowhere/python, which is no file" in NEWTON.missing
    with pytest.raises(PeerError, match="left out"):
        Session(GENESIS)
    methods = {case.method for case in worker.suite_cases("work-precision", quick=False)}
    assert not methods & {"genesis", "newton"}
    told = next(run_suite("work-precision", quick=True))
    assert told["method"] == "genesis" and "left out" in told["status"]


def test_a_peer_that_is_there_has_its_methods(monkeypatch):
    monkeypatch.setenv(GENESIS.variable, sys.executable)
    monkeypatch.delenv(NEWTON.variable, raising=False)
    cases = worker.suite_cases("work-precision", quick=False)
    assert {c.name for c in cases if c.method == "genesis"} >= {"ringing-cube-6", "free-bar-8"}
    assert not any(c.method.startswith("newton") for c in cases)
