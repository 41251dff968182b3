"""The commands about weights: which there are, where, how to get them, whether they are right."""

from typing import Annotated

import tyro
from tyro.conf import Positional

from jaxphys.core.errors import InputError, nearest

Name = Annotated[Positional[str], tyro.conf.arg(metavar="NAME")]


def list_all(*, json: bool = False) -> int:
    """List the networks that can be used, their licences, and which are on this computer.

    For example: jaxphys weights list

    Args:
        json: Print JSON.
    """
    from jaxphys.cli.weights_listing import as_json, as_text, listing

    print(as_json(listing()) if json else as_text(listing()))
    return 0


def path(name: Name, /) -> int:
    """Print where the files of a network are; fetches nothing.

    For example: jaxphys weights path smollm2

    Args:
        name: As in the list.
    """
    from jaxphys.weights import weights_path
    from jaxphys.weights.resolve import locate

    print(weights_path(name) if _is_bundled(name) else locate(name, fetch=False))
    return 0


def fetch(name: Name, /, *, half: bool = False) -> int:
    """Fetch what is missing of a network over the network, and print where it is.

    For example: jaxphys weights fetch smollm2

    Args:
        name: As in the list.
        half: Fetch half precision where it is published, which is half as much.
    """
    from jaxphys.weights import weights_path
    from jaxphys.weights.resolve import fetch as run

    print(weights_path(name) if _is_bundled(name) else run(name, half=half))
    return 0


def verify(name: Name, /) -> int:
    """Compare the files of a network with what is known of the published ones; status 1 if one is
    missing or wrong.

    For example: jaxphys weights verify point_prior

    Args:
        name: As in the list.
    """
    from jaxphys.cli.weights_listing import verdicts_text
    from jaxphys.weights import load
    from jaxphys.weights.verify import verify as run

    if _is_bundled(name):
        load(name)
        print(f"{name}: comes with this package, its SHA-256 matches")
        return 0
    folder, verdicts = run(name)
    print(verdicts_text(folder, verdicts))
    return 1 if any(verdict.problem for verdict in verdicts) else 0


def _is_bundled(name: str) -> bool:
    """Whether a network comes with this package. Raises InputError for a name of none."""
    from jaxphys.weights import manifest
    from jaxphys.weights.catalogue import known_names

    if name not in (known := {*manifest(), *known_names()}):
        raise InputError(f"weights: unknown name {name!r}; {nearest(name, known)}")
    return name in manifest()


# tyro takes functions where types stand, which no type checker knows.
Action = (
    Annotated[list_all, tyro.conf.subcommand("list")]  # type: ignore[valid-type]
    | Annotated[path, tyro.conf.subcommand("path")]  # type: ignore[valid-type]
    | Annotated[fetch, tyro.conf.subcommand("fetch")]  # type: ignore[valid-type]
    | Annotated[verify, tyro.conf.subcommand("verify")]  # type: ignore[valid-type]
)


def weights(action: Annotated[Action, tyro.conf.arg(name="")]) -> int:
    """List, find, fetch and verify the weights of published networks."""
    return action
