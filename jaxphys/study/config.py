"""What a study asks: items, the clips of each method, and the questions about them."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from jaxphys.core.dataclass_reader import from_json
from jaxphys.core.errors import InputError, shown
from jaxphys.core.fields import SEED, Checked, between
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading

LARGEST_FILE = 2**24
SCALE = (1, 2, 3, 4, 5)  # absolute category rating (ITU-T P.910)
LEFT, SAME, RIGHT = "left", "same", "right"
SIDES = (LEFT, SAME, RIGHT)
CONSENT = (
    "Taking part is voluntary, and you can stop at any time by closing this page. It keeps your"
    " answers in this browser and sends nothing; at the end you save them as a file, which holds"
    " your seat's number, your answers and how long they took, and no other data of yours."
)


@dataclass(frozen=True)
class Question(Checked):
    """What is asked of a clip, or of two side by side.

    Attributes:
        name: in results.
        text: as raters read it; it must not tell which methods there are.
        kind: "rating", from 1 to 5, or "pair", which of two, or neither.
        low, high: what 1 and 5 mean.
    """

    name: str
    text: str
    kind: Literal["rating", "pair"] = "rating"
    low: str = "bad"
    high: str = "excellent"


@dataclass(frozen=True)
class Item(Checked):
    """One thing that every method was asked for.

    Attributes:
        name: in results.
        clips: a video (.mp4), or the folder of a run, of each method, relative to the study's file.
        prompt: what raters read of it; "" tells nothing.
    """

    name: str
    clips: dict[str, str]
    prompt: str = ""


@dataclass(frozen=True)
class Study(Checked):
    """A study. Every item has a clip of every method.

    Attributes:
        items, questions: at least one of each.
        title, consent: what raters read first.
        seats: raters that pages are made for.
        ratings: clips that each rater rates, for each rating question; null: all.
        pairs: pairs that each rater compares, for each pair question; null: all.
        traps: pages of each kind, for each rater, that only the careless answer wrongly.
        seed: of every random choice.
    """

    items: tuple[Item, ...]
    questions: tuple[Question, ...]
    title: str = "Which moves as it should?"
    consent: str = CONSENT
    seats: int = field(default=20, metadata=between(1, 2000))
    ratings: int | None = field(default=None, metadata=between(1, 2000))
    pairs: int | None = field(default=None, metadata=between(1, 2000))
    traps: int = field(default=2, metadata=between(0, 20))
    seed: int = field(default=0, metadata=SEED)

    def __post_init__(self):
        super().__post_init__()
        if not self.items or not self.questions:
            raise InputError("items, questions: a study needs at least one of each")
        for what, names in (
            ("items", [item.name for item in self.items]),
            ("questions", [question.name for question in self.questions]),
        ):
            if len(set(names)) < len(names):
                raise InputError(f"{what}: two have the same name")
        for number, item in enumerate(self.items):
            if set(item.clips) != set(self.methods):
                raise InputError(
                    f"items[{number}].clips: has {shown(sorted(item.clips))}, the first item"
                    f" {shown(self.methods)}; every item needs a clip of every method"
                )
        if not self.methods:
            raise InputError("items[0].clips: is empty; name a clip for each method")
        if len(self.methods) < 2 and any(one.kind == "pair" for one in self.questions):
            raise InputError("questions: to compare pairs takes two methods at least")

    @property
    def methods(self) -> list[str]:
        """Their names, sorted."""
        return sorted(self.items[0].clips)


def read_study(path: str | os.PathLike) -> Study:
    """The study in a JSON file.

    Raises:
        InputError: one line that names the file and the field.
    """
    with reading(path):
        return from_json(Study, read_json(path, LARGEST_FILE), str(path))


def clip_file(study: Study, item: int, method: str, beside: Path) -> Path:
    """The video of an item by a method.

    Args:
        beside: the folder of the study's file.

    Raises:
        InputError: it is missing.
    """
    path = beside / study.items[item].clips[method]
    path = path / "motion.mp4" if path.is_dir() else path
    if not path.is_file() or path.suffix.lower() != ".mp4":
        raise InputError(f"items[{item}].clips: {path}: is no .mp4 file or folder of a run")
    return path
