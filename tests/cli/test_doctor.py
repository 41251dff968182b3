from jaxphys.cli.doctor import report
from jaxphys.cli.main import run


def test_this_installation_is_healthy(capsys):
    assert run(["doctor"]) == 0
    text = capsys.readouterr().out
    assert text.count("ok ") == 3 and "FAIL" not in text


def test_a_wrong_answer_fails_with_advice():
    text, healthy = report({"good": lambda: (1e-8, 1e-5), "bad": lambda: (0.1, 1e-5)})
    assert not healthy
    assert "FAIL bad" in text and "ok   good" in text and "pip install" in text


def test_not_a_number_is_a_wrong_answer():
    assert not report({"nan": lambda: (float("nan"), 1e-5)})[1]


def test_a_check_that_raises_has_failed_and_the_others_are_made():
    def broken():
        raise RuntimeError("no\nbackend")

    text, healthy = report({"bad": broken, "good": lambda: (1e-8, 1e-5)})
    assert not healthy and "pip install" in text
    assert "FAIL bad: raised RuntimeError: no backend\nok   good" in text
