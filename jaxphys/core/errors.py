"""Errors that a user can act on."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Something a user gave cannot be used: one line that says what, where, and the remedy.

    The command line prints it without a traceback and exits with status 2.
    """


def nearest(name: str, names: Iterable[str]) -> str:
    """A tail for an error about an unknown `name`: the closest of the valid `names`, then all of
    them.
    """
    names = sorted(names)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(repr(c) for c in close)}? " if close else ""
    return f"{hint}valid: {', '.join(names)}"
