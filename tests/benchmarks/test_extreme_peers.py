"""How peers are judged in the extreme scenes: motions whose verdict is known, and outcomes."""

import dataclasses

import numpy as np
import pytest

from benchmarks.extreme import motion, peers
from benchmarks.extreme.case import RIGHT, WRONG
from benchmarks.extreme.matter import SPACING
from benchmarks.extreme.peers import Column, Ran, methods, owed, turned
from benchmarks.extreme.table import peers_table
from benchmarks.peers.protocol import ENDS
from benchmarks.peers.remote import PeerError

CASES = {case.name: case for case in motion.cases()}
EVERY = [*peers.SIMILAR, *peers.LOOSE, *peers.TURNING, *peers.ALONE, *peers.BY_HENCKY]
SPIN = "block of E 2e+11, 1e3 rad/s"


def test_each_peer_has_fifteen_cases_of_the_catalogue():
    assert set(EVERY) <= set(CASES) and len(set(EVERY)) == len(EVERY)
    for peer in ("genesis", "newton"):
        assert sum(peer in methods(name) for name in EVERY) >= 15


def flown(name: str, **wrong) -> Ran:
    """Straight on, without strain or force."""
    matter = peers.asked(CASES[name], implicit=False)
    end = {key: getattr(matter, key).copy() for key in ENDS}
    end["position"] += matter.dt * matter.steps * matter.velocity
    return Ran(matter, end | {key: change(end[key]) for key, change in wrong.items()})


def outcome(measures) -> dict[str, bool]:
    return {m.name: bool(m.value <= m.most) for m in measures}


def test_a_free_flight_owes_nothing_and_each_fault_is_named():
    assert all(outcome(owed(flown("block E 1e+05"), "genesis")).values())
    faults = {
        "middle": {"position": lambda x: x + 0.02 * SPACING},
        "momentum": {"velocity": lambda v: v + 0.1 * np.abs(v).max()},
        "energy gained": {"velocity": lambda v: v.mean(axis=0) + 1.5 * (v - v.mean(axis=0))},
    }
    for name, fault in faults.items():
        assert not outcome(owed(flown("block E 1e+05", **fault), "genesis"))[name]
    spun = {"velocity": lambda v: v + np.cross([0, 0, 2.0], flown("block E 1e+05").end["position"])}
    assert not outcome(owed(flown("block E 1e+05", **spun), "genesis"))["angular momentum"]


def test_a_rigid_turn_is_right_and_a_straight_flight_is_not():
    run = flown(SPIN)
    assert not all(outcome(turned(run)).values())
    angle = 1e3 * run.matter.dt * run.matter.steps
    middle = run.matter.position.mean(axis=0)
    flat = (run.matter.position - middle)[:, :2] @ [1, 1j] * np.exp(1j * angle)
    place = np.stack([flat.real, flat.imag, run.matter.position[:, 2] - middle[2]], axis=1)
    assert all(outcome(turned(Ran(run.matter, run.end | {"position": place + middle}))).values())


def test_energies_agree_at_small_strain_and_there_is_none_inside_out():
    matter = peers.asked(CASES["block E 1e+05"], implicit=False)
    small = np.eye(3) + 1e-3 * (matter.deformation - np.eye(3))
    e = 0.5 * (small + np.swapaxes(small, 1, 2)) - np.eye(3)
    mu, lam = 1e5 / 2.6, 1e5 * 0.3 / (1.3 * 0.4)
    trace = np.trace(e, axis1=1, axis2=2)
    linear = mu * np.sum(e**2, axis=(1, 2)) + 0.5 * lam * trace**2
    for law in ("neo-Hookean", "fixed corotated", "Hencky"):
        np.testing.assert_allclose(peers.stored(law, matter, small), linear, rtol=5e-3)
    mirrored = np.broadcast_to(np.diag([1.0, 1.0, -1.0]), small.shape)
    assert np.isnan(peers.stored("neo-Hookean", matter, mirrored)).all()


@pytest.mark.parametrize("kind", ["right", "wrong", "NaN", "error"])
def test_outcomes_and_their_place_in_the_table(kind, monkeypatch):
    def ran(self, name):
        if kind == "error":
            raise PeerError("genesis: ValueError: no such | thing")
        changes = {
            "right": {},
            "wrong": {"position": lambda x: x + SPACING},
            "NaN": {"velocity": lambda v: v * np.nan},
        }[kind]
        return flown("thread", **changes)

    monkeypatch.setattr(Column, "ran", ran)
    line = peers.line(CASES["thread"], "genesis", Column("genesis", CASES))
    assert line["outcome"] == {"right": RIGHT, "wrong": WRONG}.get(kind, kind)
    text = peers_table([line], "f")
    assert f"genesis: 1 cases, 1 {kind}." in text
    told = {"wrong": "**wrong**: middle 1 |", "NaN": "**NaN**", "error": "ValueError: no such / th"}
    assert told.get(kind, "right ") in text


def test_without_peers_there_are_only_lines_that_say_so(monkeypatch):
    missing = tuple(dataclasses.replace(peer, variable="JAXPHYS_NO_SUCH") for peer in peers.PEERS)
    monkeypatch.setattr(peers, "PEERS", missing)
    told = list(peers.lines(quick=True))
    assert [line["method"] for line in told] == ["genesis", "newton"]
    assert all("JAXPHYS_NO_SUCH is not set" in line["status"] for line in told)
