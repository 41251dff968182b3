"""The command line: thin commands over the pipeline."""

import sys
import warnings
from collections.abc import Sequence

import tyro

from jaxphys.cli import commands, weights
from jaxphys.cli.evaluate import evaluate
from jaxphys.core.errors import InputError

INTERRUPTED = 130


def run(arguments: Sequence[str] | None = None) -> int:
    """Runs one command; returns the exit status.

    What a user can mend is one line on standard error and status 2; an interrupt is 130.
    """
    try:
        status = tyro.extras.subcommand_cli_from_dict(
            {
                "generate": commands.generate,
                "image": commands.image,
                "animate": commands.animate,
                "splat": commands.splat,
                "render": commands.render,
                "plan": commands.plan,
                "materials": commands.materials,
                "evaluate": evaluate,
                "weights": weights.weights,
                "doctor": commands.doctor,
            },
            prog="jaxphys",
            description="Objects from text, meshes or splats that move as their material would.",
            args=None if arguments is None else list(arguments),
        )
    except InputError as error:
        print(f"jaxphys: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:
        # A full disk or a folder that must not be written to is for the user to mend too.
        where = f"{error.filename}: " if error.filename else ""
        print(f"jaxphys: {where}{error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("jaxphys: interrupted; the same command resumes", file=sys.stderr)
        return INTERRUPTED
    return status or 0


def main() -> None:
    """Entry point of the `jaxphys` command."""
    # Warnings of libraries tell users of this command nothing that they could act on.
    warnings.simplefilter("ignore")
    sys.exit(run())
