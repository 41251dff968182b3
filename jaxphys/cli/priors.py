"""The command that says what the bundled priors and the library know."""

import json as json_module
import textwrap


def priors(*, json: bool = False) -> int:
    """List the objects that the library makes and the bundled priors learn from, by family.

    For example: jaxphys priors --json

    Args:
        json: Print JSON, with other names, parts, colours and options.
    """
    from jaxphys.library import KINDS
    from jaxphys.library.kinds import Kind

    if json:
        print(json_module.dumps([_facts(kind) for kind in KINDS.values()], indent=2))
        return 0
    families: dict[str, list[Kind]] = {}
    for kind in KINDS.values():
        families.setdefault(kind.family, []).append(kind)
    for family in sorted(families):
        names = ", ".join(kind.name for kind in families[family])
        print(f"{family}:")
        print(textwrap.fill(names, 98, initial_indent="  ", subsequent_indent="  "))
    print(f"{len(KINDS)} kinds; colours and options of each: jaxphys priors --json")
    return 0


def _facts(kind) -> dict:
    return {
        "name": kind.name,
        "family": kind.family,
        "also": list(kind.also),
        "parts": {part: list(colours) for part, colours in kind.colours.items()},
        "options": {
            name: {"type": option.type, "words": [word for word in option.values if word]}
            for name, option in kind.options.items()
        },
    }
