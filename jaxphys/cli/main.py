"""The command line: thin commands over the pipeline, and the border where errors become lines.

Exit status: 0 done; 1 something was found wrong, or this program is at fault; 2 what was asked for
cannot be done; 130 interrupted; 141 whoever read the output has gone.
"""

import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import tyro

from jaxphys.cli import commands, weights
from jaxphys.cli.devices import DEVICES, use_devices, without_devices
from jaxphys.cli.evaluate import evaluate
from jaxphys.cli.export import export
from jaxphys.cli.fit import fit
from jaxphys.cli.page import page
from jaxphys.cli.priors import priors
from jaxphys.cli.reconstruct import reconstruct
from jaxphys.cli.study import study
from jaxphys.core.errors import InputError, one_line

FAULT, REFUSED, INTERRUPTED, UNHEARD = 1, 2, 130, 141
TRACEBACK = "--traceback"
COMMANDS: dict[str, Callable[..., int]] = {
    "generate": commands.generate,
    "image": commands.image,
    "animate": commands.animate,
    "reconstruct": reconstruct,
    "splat": commands.splat,
    "render": commands.render,
    "export": export,
    "plan": commands.plan,
    "fit": fit,
    "materials": commands.materials,
    "priors": priors,
    "evaluate": evaluate,
    "page": page,
    "study": study,
    "weights": weights.weights,
    "doctor": commands.doctor,
}


def run(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit status.

    What goes wrong is one line on standard error, and with `--traceback` anywhere among the
    arguments the traceback before it.

    Raises:
        BrokenPipeError: nobody reads standard output any more.
    """
    given = sys.argv[1:] if arguments is None else list(arguments)
    wanted = [argument for argument in given if argument != TRACEBACK]
    try:
        words, devices = without_devices(wanted)
        use_devices(devices)
        return _dispatch(words)
    except BrokenPipeError:
        raise
    except (Exception, KeyboardInterrupt) as error:
        if len(wanted) < len(given):
            traceback.print_exc()
        line, status = _told(error)
        print(f"jaxphys: {line}", file=sys.stderr)
        return status


def _dispatch(arguments: list[str]) -> int:
    status = tyro.extras.subcommand_cli_from_dict(
        COMMANDS,
        prog="jaxphys",
        description=(
            "Objects from text, meshes or splats that move as their material would. With"
            f" {TRACEBACK} anywhere, an error shows where in the program it came up; {DEVICES} N"
            " spreads particles over N cores, by default over all."
        ),
        args=arguments,
    )
    return status or 0


def _told(error: BaseException) -> tuple[str, int]:
    """An error as a line and an exit status."""
    match error:
        case InputError():
            return str(error), REFUSED
        case KeyboardInterrupt():
            return "interrupted; the same command resumes", INTERRUPTED
        case OSError():
            # A full disk or a folder that must not be written to is for the user to mend too.
            where = f"{error.filename}: " if error.filename else ""
            return one_line(f"{where}{error.strerror or error}"), REFUSED
        case MemoryError():
            return "there is not enough memory for this; ask for less at a time", REFUSED
    if (line := _no_device()) is not None:
        return line, REFUSED
    notes = [note for note in getattr(error, "__notes__", ()) if note.startswith("while reading")]
    what = one_line(" ".join([f"unexpected {type(error).__name__}", *notes]) + f": {error}", 220)
    return f"{what}; run with {TRACEBACK} to see it, and please report it", FAULT


def _no_device() -> str | None:
    """Why JAX cannot compute at all, which comes up at its first use, wherever that is."""
    if "jax" not in sys.modules:
        return None
    try:
        sys.modules["jax"].devices()
    except RuntimeError as error:
        platforms = os.environ.get("JAX_PLATFORMS", "")
        return one_line(f"JAX_PLATFORMS={platforms!r}: JAX finds no device ({error})")
    return None


def main() -> None:
    """Entry point of the `jaxphys` command."""
    # Warnings of libraries tell users of this command nothing that they could act on.
    warnings.simplefilter("ignore")
    streams: tuple[Any, ...] = (sys.stdout, sys.stderr)
    for stream in streams:
        # A terminal that knows ASCII only gets the code of a letter instead of a traceback.
        if stream is not None:  # as it is where it was closed from outside
            stream.reconfigure(errors="backslashreplace")
    try:
        status = run()
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt:  # a second one, while the first was told
        status = INTERRUPTED
    except OSError as error:
        if not isinstance(error, BrokenPipeError):
            print(f"jaxphys: {_told(error)[0]}", file=sys.stderr)
        status = UNHEARD if isinstance(error, BrokenPipeError) else REFUSED
        # Python flushes once more as it ends, and would complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    finally:
        # Whoever interrupts the end of the program means it, and needs no traceback.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(status)
