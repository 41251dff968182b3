"""The harness's arithmetic: medians over processes, ratios round by round, failures kept."""

import json

import pytest

from benchmarks import worker
from benchmarks.case import Case, Prepared
from benchmarks.harness import baseline_costs, merge_rounds, peer_ratios

IDENTITY = {"suite": "s", "case": "c", "method": "jaxphys"}


def round_of(seconds: float, method: str = "jaxphys", work: float = 10.0) -> dict:
    return {
        "suite": "s",
        "case": "c",
        "method": method,
        "status": "ok",
        "seconds": seconds,
        "samples": [seconds] * 3,
        "work": work,
        "peak_bytes": 1,
        "error": None,
        "compile_seconds": None,
    }


def test_median_over_processes_not_over_samples():
    line = merge_rounds(IDENTITY, [round_of(1.0), round_of(9.0), round_of(2.0)])
    assert line["seconds"] == 2.0
    assert (line["seconds_low"], line["seconds_high"]) == (1.0, 9.0)
    assert len(line["samples"]) == 3


def test_a_failed_round_is_reported_not_dropped():
    line = merge_rounds(IDENTITY, [round_of(1.0), {"status": "exit 1: boom"}])
    assert "1 of 2 rounds failed" in line["status"] and "boom" in line["status"]
    assert merge_rounds(IDENTITY, [{"status": "timeout"}])["status"] == "timeout"


def test_ratio_is_work_per_second_of_ours_over_theirs():
    ours = merge_rounds(IDENTITY, [round_of(1.0, work=30.0), round_of(2.0, work=30.0)])
    theirs = merge_rounds(
        IDENTITY | {"method": "taichi"}, [round_of(1.0, "taichi"), round_of(2.0, "taichi")]
    )
    (ratio,) = peer_ratios([ours, theirs])
    assert ratio["peer"] == "taichi" and ratio["ratio"] == pytest.approx(3.0)
    assert list(peer_ratios([theirs])) == []


def test_our_own_variants_are_not_peers():
    ours = merge_rounds(IDENTITY, [round_of(1.0)])
    variant = merge_rounds(IDENTITY | {"method": "jaxphys-scatter"}, [round_of(1.0)])
    assert list(peer_ratios([ours, variant])) == []


def test_worker_measures_and_prints_one_json_line(monkeypatch, capsys):
    calls = []
    case = Case(
        "tiny",
        "jaxphys",
        lambda: Prepared(lambda: calls.append(1), work=4.0, error=lambda: 0.25),
        {"particles": 2},
    )
    monkeypatch.setattr(worker, "suite_cases", lambda suite, quick: [case])
    worker.main("mpm", "tiny", "jaxphys", quick=True)
    line = json.loads(capsys.readouterr().out)
    assert line["particles"] == 2 and line["work"] == 4.0 and line["error"] == 0.25
    assert len(line["samples"]) == len(calls) - 1 >= worker.MINIMUM_CALLS
    assert line["versions"]["jax"]


def test_a_whole_run_is_called_once(monkeypatch):
    calls = []
    case = Case("run", "jaxphys", lambda: Prepared(lambda: calls.append(1), 1.0, once=True))
    monkeypatch.setattr(worker, "suite_cases", lambda suite, quick: [case])
    line = worker.measure("headline", "run", "jaxphys", quick=False)
    assert len(calls) == len(line["samples"]) == 1


# The suite of outcomes has lines of its own (tests/benchmarks/test_extreme.py).
@pytest.mark.parametrize(
    "suite", [suite for suite in worker.SUITES if not suite.startswith("extreme")]
)
@pytest.mark.parametrize("quick", [True, False])
def test_every_suite_lists_cases_of_its_own_names(suite, quick):
    cases = worker.suite_cases(suite, quick)
    assert cases and len({(c.name, c.method) for c in cases}) == len(cases)
    assert any(case.method == "jaxphys" for case in cases)


def test_cost_is_time_per_work_over_the_baseline():
    ours = merge_rounds(IDENTITY, [round_of(3.0), round_of(8.0)])
    base = merge_rounds(IDENTITY | {"method": "jaxphys-forward"}, [round_of(1.0), round_of(2.0)])
    (line,) = baseline_costs([ours, base], {"jaxphys-forward"})
    assert line["baseline"] == "jaxphys-forward" and line["cost"] == pytest.approx(3.5)
    assert (line["cost_low"], line["cost_high"]) == pytest.approx((3.0, 4.0))
    assert list(baseline_costs([ours, base], set())) == []
    assert list(baseline_costs([base], {"jaxphys-forward"})) == []


def test_gradients_and_plastic_laws_have_their_baseline_in_the_same_case():
    def pairs(suite):
        cases = worker.suite_cases(suite, quick=False)
        return {(c.name, c.method) for c in cases if c.baseline}

    assert pairs("mpm-grad") == {(size, "jaxphys-forward") for size in ("50k-100", "50k-2000")}
    assert pairs("mpm") == {
        (f"{law}-{size}", "jaxphys-neo-Hookean")
        for law in ("metal", "sand")
        for size in ("64k", "262k")
    }


def test_peers_run_in_the_cases_that_they_can():
    def peers(suite):
        cases = worker.suite_cases(suite, quick=False)
        return {c.name for c in cases if c.method == "taichi"}

    laws = ("neo-hookean", "fixed-corotated")
    assert peers("mpm") == {f"{law}-{size}" for law in laws for size in ("64k", "262k")}
    # Every step of 50k-2000 would take 47 GB.
    assert peers("mpm-grad") == {"50k-100"}


def test_a_sweep_goes_on_where_it_was_stopped(monkeypatch, tmp_path):
    """Cases that the file has lines of are not run again; --resume alone says so."""
    from benchmarks import __main__ as program
    from benchmarks import harness

    cases = [Case(name, "jaxphys", lambda: None, {"n": 1}, rounds=1) for name in ("a", "b", "c")]
    monkeypatch.setattr(harness, "suite_cases", lambda suite, quick: cases)
    ran = []

    def process(suite, name, method, quick):
        ran.append(name)
        return round_of(1.0) | {"case": name}

    monkeypatch.setattr(harness, "run_process", process)
    out = tmp_path / "lines.jsonl"
    other = {"suite": "headline", "case": "c"}
    out.write_text(json.dumps({"suite": "mpm", "case": "a"}) + "\n" + json.dumps(other) + "\n")
    command = ["benchmarks", "run", "mpm", "--out", str(out)]
    monkeypatch.setattr("sys.argv", [*command, "--resume"])
    program.main()
    assert ran == ["b", "c"]
    monkeypatch.setattr("sys.argv", command)
    program.main()
    assert ran == ["b", "c", "a", "b", "c"]


def test_coarse_grids_of_all_problems_come_first():
    from benchmarks.work_precision import LADDERS, cases

    names = list(dict.fromkeys(case.name for case in cases(quick=False)))
    coarse = [f"{name}-{ladder[0]}" for name, ladder in LADDERS.items()]
    assert names[: len(coarse)] == coarse
