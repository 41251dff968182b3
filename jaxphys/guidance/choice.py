"""From the names of priors to guides told a prompt, and to the settings that suit them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from jaxphys.core.errors import InputError, nearest
from jaxphys.guidance.bundled.pixel_guide import bundled_image_guide
from jaxphys.guidance.bundled.priors import require_prior
from jaxphys.guidance.bundled.shape_guide import bundled_shape_guide, shape_weights
from jaxphys.guidance.diffusion.score_distillation import DistillationConfig, Method
from jaxphys.guidance.guides import Guides, ImageGuide, ShapeGuide
from jaxphys.guidance.optimise import OptimiseConfig
from jaxphys.guidance.published import point_e_guide, stable_diffusion
from jaxphys.guidance.stages import Stage, two
from jaxphys.weights.catalogue import CATALOGUE
from jaxphys.weights.resolve import locate

BUNDLED = "bundled"
LIBRARY = "library"
POINT_E = "point-e"
STABLE_DIFFUSION = ("stable-diffusion-1.5", "stable-diffusion-2.1-base", "stable-diffusion-2.1")

# What GSGEN's released configuration does, in lengths of the object and weights relative to the
# image loss: guidance 100, noise levels from 0.98 down, and the paper's two stages.
LATENT = OptimiseConfig(
    count=4096,
    steps=5000,
    room=2.0,
    image=DistillationConfig(
        guidance=100.0, rescale=0.0, weight="sigma_squared", time=(0.02, 0.98, 0.5), limit=None
    ),
    stages=two(
        0.15,
        (
            ("means", 3e-3),
            ("log_scales", 3e-3),
            ("quaternions", 3e-3),
            ("opacity_logits", 3e-3),
            ("harmonics", 1e-2),
        ),
    ),
    density_every=500,
)
POINT_E_DISTILLATION = DistillationConfig(
    guidance=100.0, rescale=0.0, weight="sigma_squared", time=(0.02, 0.98, 0.98)
)
POINT_E_WEIGHT = 0.04
# The first of two stages' share of the steps for the bundled priors, whose runs are short.
BUNDLED_GEOMETRY = 0.5


def settings(
    prior: str,
    shape_prior: str,
    *,
    stages: Literal["one", "two"] | None = None,
    distillation: Method = "sds",
    perp_neg: bool = False,
) -> OptimiseConfig:
    """How to optimise with a 2D and a 3D prior, given by name or folder.

    Args:
        stages: "two" as the paper has them, see `stages.two`, or "one" with everything at once;
            None: two for published 2D priors, one for the bundled one.
        distillation, perp_neg: of the 2D prior, see `DistillationConfig`. "ism" takes its authors'
            guidance and weight where the prior is a published one.
    """
    config = OptimiseConfig() if prior == BUNDLED else LATENT
    first = config.stages[0]
    if stages == "one":
        config = replace(config, stages=(Stage(rates=first.rates),))
    elif stages == "two":
        share = BUNDLED_GEOMETRY if prior == BUNDLED else first.share
        config = replace(config, stages=two(share, first.rates))
    image = replace(config.image, method=distillation, perp_neg=perp_neg)
    if distillation == "ism" and prior != BUNDLED:
        image = replace(image, guidance=7.5, weight="clean")
    config = replace(config, image=image)
    if shape_prior != BUNDLED:
        config = replace(
            config,
            count=4096,  # as many as it draws, evenly spread: none are left out
            oversampling=1.0,
            shape=POINT_E_DISTILLATION,
            shape_weight=POINT_E_WEIGHT,
        )
    return config


def published_folder(
    given: str, names: Sequence[str], option: str, parts: Sequence[str], *, half: bool = False
) -> Path:
    """Where the files of a published prior are, fetched if they are nowhere yet.

    Args:
        given: one of `names`, an alias of one, or a folder.
        option: what `given` answers, for errors.
        parts: files and folders that are needed.
        half: what is fetched may be of half precision, see `locate`.

    Raises:
        InputError: no such name or folder, or files that are missing and cannot be had.
    """
    known = {alias: name for name in names for alias in (name, *CATALOGUE[name].aliases)}
    if given in known:
        return locate(known[given], parts=parts or None, half=half)
    if not Path(given).is_dir():
        own = [BUNDLED, LIBRARY] if option == "prior" else [BUNDLED]
        valid = nearest(given, [*own, *known])
        raise InputError(f"{option} {given}: is no folder and no name of a prior; {valid}")
    lacking = [part for part in parts if not (Path(given) / part).exists()]
    if lacking:
        raise InputError(
            f"{option} {given}: lacks {', '.join(lacking)}; copy the whole model there"
        )
    return Path(given)


def require(prior: str, shape_prior: str, *, dtype: str = "bfloat16") -> None:
    """Raises `InputError` if the weights of the named priors are not at hand and cannot be had,
    before any work is done."""
    if prior == LIBRARY:
        if shape_prior != BUNDLED:
            raise InputError("shape_prior: is not asked where --prior library makes the object")
        return
    if prior == BUNDLED:
        require_prior("pixel_prior")
    else:
        image_folder(prior, dtype=dtype)
    if shape_prior == BUNDLED:
        for name in shape_weights():
            require_prior(name)
    else:
        shape_folders(shape_prior)


def image_folder(prior: str, *, dtype: str = "bfloat16") -> Path:
    """The folder of a Stable Diffusion, see `published_folder`; for `dtype` of 16 bits, 16 bits
    are fetched."""
    half = dtype != "float32"
    return published_folder(prior, STABLE_DIFFUSION, "prior", stable_diffusion.PARTS, half=half)


def image_guide(
    prior: str, prompt: str, *, negative: str, dtype: str, attention_slice: int | None
) -> ImageGuide:
    """The 2D prior of a name or folder, told a refined prompt. Raises InputError as `require`."""
    if prior == BUNDLED:
        return bundled_image_guide(prompt, negative)
    return stable_diffusion.stable_diffusion_guide(
        prompt,
        image_folder(prior, dtype=dtype),
        negative=negative,
        dtype=dtype,
        attention_slice=attention_slice,
    )


def shape_folders(shape_prior: str) -> tuple[Path, Path]:
    """The folders of Point-E and of the CLIP that reads for it, see `published_folder`."""
    folder = published_folder(shape_prior, (POINT_E,), "shape_prior", ())
    point_e_guide.files(folder)
    return folder, locate(point_e_guide.CLIP)


def shape_guide(shape_prior: str, prompt: str, *, dtype: str) -> ShapeGuide:
    """The 3D prior of a name or folder, told a refined prompt. Raises InputError as `require`."""
    if shape_prior == BUNDLED:
        return bundled_shape_guide(prompt)
    folder, clip = shape_folders(shape_prior)
    return point_e_guide.point_e_guide(prompt, folder, clip, dtype=dtype)


def guides(
    prompt: str,
    *,
    prior: str = BUNDLED,
    shape_prior: str = BUNDLED,
    negative: str = "",
    dtype: str = "bfloat16",
    attention_slice: int | None = None,
) -> Guides:
    """Both guides, see `image_guide` and `shape_guide`."""
    image = image_guide(
        prior, prompt, negative=negative, dtype=dtype, attention_slice=attention_slice
    )
    return Guides(image, shape_guide(shape_prior, prompt, dtype=dtype))
