"""The files that raters hand in, read against the key; what is not as it must be is refused."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jaxphys.core.errors import InputError, shown
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.study.config import SCALE, SIDES
from jaxphys.study.design import Page
from jaxphys.study.make import KEY, KEY_FORMAT, KEY_VERSION
from jaxphys.study.study_page import FORMAT, VERSION

LARGEST_FILE = 2**24


@dataclass(frozen=True)
class Key:
    """What was shown.

    Attributes:
        study: its identity.
        questions: name and kind of each.
        items, methods: names.
        seats: pages of each seat.
    """

    study: str
    questions: tuple[tuple[str, str], ...]
    items: tuple[str, ...]
    methods: tuple[str, ...]
    seats: tuple[tuple[Page, ...], ...]


@dataclass(frozen=True)
class Answers:
    """What one rater said.

    Attributes:
        seat: number of it.
        values: of each page, None where a clip did not play.
        finished: whether the last page was reached.
        simulated: whether no person answered.
        source: the file's name.
    """

    seat: int
    values: tuple[str | int | None, ...]
    finished: bool
    simulated: bool
    source: str


def read_key(folder: str | os.PathLike) -> Key:
    """The key in a study's folder.

    Raises:
        InputError: it is missing or damaged.
    """
    path = Path(folder) / KEY
    with reading(path):
        value = read_json(path, LARGEST_FILE)
        _require(value, "format", KEY_FORMAT)
        _require(value, "version", KEY_VERSION)
        try:
            return Key(
                str(value["study"]),
                tuple((str(one["name"]), str(one["kind"])) for one in value["questions"]),
                tuple(map(str, value["items"])),
                tuple(map(str, value["methods"])),
                tuple(tuple(map(_page, pages)) for pages in value["seats"]),
            )
        except (KeyError, TypeError, ValueError, IndexError):
            raise InputError("is damaged; make the study again") from None


def _page(value: dict[str, Any]) -> Page:
    clips = tuple((int(item), int(method)) for item, method in value["clips"])
    return Page(int(value["question"]), clips, value["wanted"])


def read_answers(paths: Sequence[str | os.PathLike], key: Key) -> list[Answers]:
    """The answers of some raters.

    Raises:
        InputError: a file holds no answers to this study, or two are of the same seat.
    """
    found: dict[int, Answers] = {}
    for path in map(Path, paths):
        with reading(path):
            one = _answers(read_json(path, LARGEST_FILE), key, path.name)
        if one.seat in found:
            raise InputError(
                f"{path}: is of seat {one.seat + 1}, as {found[one.seat].source} is; a seat is one"
                " rater's"
            )
        found[one.seat] = one
    return [found[seat] for seat in sorted(found)]


def _answers(value: dict[str, Any], key: Key, source: str) -> Answers:
    _require(value, "format", FORMAT)
    _require(value, "version", VERSION)
    _require(value, "study", key.study)
    seat, given = value.get("seat"), value.get("answers")
    if not isinstance(seat, int) or isinstance(seat, bool) or not 0 <= seat < len(key.seats):
        raise InputError(f"seat: {shown(seat)} is none of this study's")
    pages = key.seats[seat]
    if not isinstance(given, list) or len(given) > len(pages):
        raise InputError(f"answers: expected a list of at most {len(pages)}, found {shown(given)}")
    values = tuple(
        _value(entry, number, key.questions[pages[number].question][1])
        for number, entry in enumerate(given)
    )
    flags = [value.get(name, False) for name in ("finished", "simulated")]
    if not all(isinstance(flag, bool) for flag in flags):
        raise InputError("finished, simulated: expected true or false")
    return Answers(seat, values, flags[0] and len(values) == len(pages), flags[1], source)


def _value(entry: Any, number: int, kind: str) -> str | int | None:
    if not isinstance(entry, dict) or entry.get("page") != number or "answer" not in entry:
        raise InputError(f"answers[{number}]: is no answer to page {number}: {shown(entry)}")
    answer = entry["answer"]
    allowed: tuple[str | int, ...] = SCALE if kind == "rating" else SIDES
    if answer is None or (type(answer) in (int, str) and answer in allowed):
        return answer
    raise InputError(
        f"answers[{number}].answer: {shown(answer)} is none of {', '.join(map(str, allowed))}"
    )


def _require(value: dict[str, Any], name: str, wanted: Any) -> None:
    if value.get(name) != wanted:
        raise InputError(f"{name}: expected {shown(wanted)}, found {shown(value.get(name))}")
