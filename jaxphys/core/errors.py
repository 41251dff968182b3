"""Errors that a user can act on, and how they are worded."""

import difflib
from collections.abc import Iterable

LONGEST_LINE = 300
LONGEST_VALUE = 60


def shortened(text: str, longest: int) -> str:
    """`text` with its middle left out where it has more than `longest` characters: what is wrong
    stands at the beginning of a message, the remedy at its end.
    """
    if len(text) <= longest:
        return text
    head = (longest - 5) * 2 // 3
    return f"{text[:head]} ... {text[len(text) - (longest - 5 - head) :]}"


def one_line(text: str, longest: int = LONGEST_LINE) -> str:
    """`text` as one line for a terminal: what does not print (escapes, controls, halves of
    surrogate pairs) as a Python literal has it, runs of white space as one space, shortened.
    """
    text = " ".join(shortened(text, 4 * longest).split())
    return shortened("".join(c if c.isprintable() else repr(c)[1:-1] for c in text), longest)


def shown(value: object, longest: int = LONGEST_VALUE) -> str:
    """A value out of a file, quoted for a message."""
    try:
        text = repr(shortened(value, longest) if isinstance(value, str) else value)
    except (RecursionError, ValueError):  # nested too deeply, a number of too many digits
        text = f"a {type(value).__name__} that is too large to show"
    return one_line(text, longest + 8)


class InputError(ValueError):
    """Something a user gave cannot be used: one line that says what, where, and the remedy.

    The command line prints it without a traceback and exits with status 2. `longest` is for the
    few messages that list what a user has to fetch.
    """

    def __init__(self, message: object, longest: int = LONGEST_LINE):
        super().__init__(one_line(str(message), longest))


def nearest(name: str, names: Iterable[str]) -> str:
    """A tail for an error about an unknown `name`: the closest of the valid `names`, then all of
    them.
    """
    names = sorted(names)
    # Comparing takes the product of the lengths, and a name out of a file may be of any length.
    close = difflib.get_close_matches(shortened(name, 100), names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(repr(c) for c in close)}? " if close else ""
    return f"{hint}valid: {', '.join(names)}"
