"""An object straight from the parametric model that the words mean: no prior is asked."""

from typing import TYPE_CHECKING, Any

import numpy as np

from jaxphys.core.errors import InputError
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.surface import even_samples, gaussians_from_samples
from jaxphys.guidance import views
from jaxphys.guidance.guides import object_of, phrases_of

if TYPE_CHECKING:  # the library is large, and loaded where it is asked for
    from jaxphys.library.model import Model

COUNT = 30_000
OVERSAMPLING = 3  # as for meshes: what is crowded is thinned out
MOST_PHRASES = 32


def is_known(prompt: str) -> bool:
    """Whether there is a parametric model of what a prompt names."""
    from jaxphys.library.asked import asked

    return asked(phrases_of(prompt, MOST_PHRASES)) is not None


def nearest_kinds(prompt: str, count: int = 3) -> list[str]:
    """The kinds whose names are nearest in meaning to what a prompt names, nearest first."""
    from jaxphys.guidance.bundled.text_encoder import load_text_encoder
    from jaxphys.library import KINDS

    wanted, *names = load_text_encoder()([object_of(prompt), *KINDS])
    order = np.argsort(-(np.stack(names) @ wanted))
    return [list(KINDS)[index] for index in order[:count]]


def unknown(prompt: str) -> str:
    """What to tell somebody who asks for what is not known."""
    near = ", ".join(nearest_kinds(prompt))
    return (
        f"prompt: {object_of(prompt)!r} is none of the objects that the bundled priors learn from;"
        f" the nearest are {near} (`jaxphys priors` lists all); ask for one of those, or take"
        " --prior stable-diffusion"
    )


def require_known(prompt: str) -> None:
    """Raises InputError where there is no parametric model, before any work is done."""
    if not is_known(prompt):
        raise InputError(unknown(prompt))


def library_object(
    prompt: str, seed: int = 0, count: int = COUNT
) -> tuple[Gaussians, dict[str, Any]]:
    """Flat Gaussians on the parametric model of what `prompt` names, with the colours, parts and
    options that it names and a random shape beyond, the same for the same seed; and what was made,
    as plain data.

    Centred, z up, front +x, longest side 1; coloured as the priors' objects are.

    Raises:
        InputError: there is no such model.
    """
    from jaxphys.library import KINDS, usual
    from jaxphys.library.asked import asked

    require_known(prompt)
    wanted = asked(phrases_of(prompt, MOST_PHRASES))
    assert wanted is not None
    # Sizes and forms that nobody asks for are the plain ones, as nobody would leave them unsaid.
    marked = {n: o for n, o in KINDS[wanted.kind].options.items() if o.type in ("size", "form")}
    given = {name: ("",) for name, option in marked.items() if "" in option.values}
    for name, words in wanted.given.items():
        given[name] = (*given.get(name, ()), *words)
    built = usual(wanted.kind, seed, given)
    return gaussians_of(built.model, count, seed), built.attributes


def gaussians_of(model: "Model", count: int, seed: int = 0) -> Gaussians:
    """`count` flat Gaussians, evenly over what is seen of a parametric model; lit from above, as
    the priors' objects are.
    """
    surface = model.sample(OVERSAMPLING * count, np.random.default_rng(seed))
    colours = views.lit(surface.colours, surface.normals)
    return gaussians_from_samples(even_samples(surface.points, surface.normals, colours, count))
