"""Whatever is in a file or on a command line ends in success or in one line that names it."""

import contextlib
import io
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxphys.cli.main import run
from jaxphys.core.errors import LONGEST_LINE, InputError
from tests.fuzz.command_lines import command_line, furnish
from tests.fuzz.readers import CASES, spoil

SEEDS = st.integers(0, 2**32)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("name", CASES)
def test_what_is_not_spoiled_is_read(name, tmp_path):
    CASES[name].write(tmp_path / CASES[name].file)
    CASES[name].read(tmp_path / CASES[name].file)


@pytest.mark.filterwarnings("ignore")  # libraries warn of what they then read all the same
@pytest.mark.parametrize("name", CASES)
@settings(max_examples=25)
@given(seed=SEEDS)
def test_spoiled_files(name, seed, folder):
    path = spoil(CASES[name], folder, random.Random(seed))
    try:
        CASES[name].read(path)
    except InputError as error:
        message = str(error)
        assert message.isprintable() and len(message) <= LONGEST_LINE
        assert str(folder) in message


@pytest.fixture(scope="module")
def furnished(tmp_path_factory):
    place = tmp_path_factory.mktemp("commands")
    furnish(place)
    return place


@pytest.mark.filterwarnings("ignore")
@settings(max_examples=150)
@given(seed=SEEDS)
def test_command_lines(seed, furnished):
    arguments = command_line(furnished, random.Random(seed))
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        try:
            status = run(arguments)
        except SystemExit as stop:  # the parser's own refusal, several lines long
            assert stop.code == 2
            return
    assert status in (0, 2) or (status == 1 and arguments[0] == "weights")
    told = [line for line in errors.getvalue().splitlines() if line.startswith("jaxphys: ")]
    assert len(told) == (status == 2)
    assert all(line.isprintable() for line in told)
    if "--traceback" not in arguments:
        assert "Traceback" not in errors.getvalue()
