"""The commands about studies with people: the page to hand out, and what its answers say."""

from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional


def make(
    config: Annotated[Positional[Path], tyro.conf.arg(metavar="STUDY.json")],
    /,
    *,
    out: Path,
    overwrite: bool = False,
) -> int:
    """Make a blinded, balanced page of a study, and the key to it.

    For example: jaxphys study make study.json --out outputs/study

    Args:
        config: Items, clips of each method, questions; see docs/study.md.
        out: Folder for page/, to hand out, and key.json, to keep.
        overwrite: Replace the files of another study, and only these.
    """
    from jaxphys.study.make import make_study

    folder = make_study(config, out, overwrite=overwrite)
    print(f"{folder / 'page'}: hand this folder out; {folder / 'key.json'} stays with you")
    return 0


def analyse(
    folder: Annotated[Positional[Path], tyro.conf.arg(metavar="STUDY")],
    answers: Annotated[Positional[tuple[Path, ...]], tyro.conf.arg(metavar="ANSWERS.json")],
    /,
    *,
    failures: int = 0,
    json: bool = False,
) -> int:
    """Mean opinion scores and Bradley-Terry strengths of a study, with intervals by raters.

    For example: jaxphys study analyse outputs/study ANSWERS.json

    Args:
        folder: Made by `study make`.
        answers: The files that raters handed in.
        failures: Traps that a rater may fail and still count.
        json: Print JSON.
    """
    from json import dumps

    from jaxphys.study.analysis import analyse as run
    from jaxphys.study.analysis import as_text

    result = run(folder, answers, failures=failures)
    print(dumps(result, indent=2) if json else as_text(result))
    return 0


# tyro takes functions where types stand, which no type checker knows.
Action = (
    Annotated[make, tyro.conf.subcommand("make")]  # type: ignore[valid-type]
    | Annotated[analyse, tyro.conf.subcommand("analyse")]  # type: ignore[valid-type]
)


def study(action: Annotated[Action, tyro.conf.arg(name="")]) -> int:
    """Let people compare methods: make a blinded page, analyse its answers."""
    return action
