"""A picture from a sentence, as a file."""

from pathlib import Path
from typing import Any

from jaxphys.core.errors import InputError
from jaxphys.core.fields import SEED, check_number
from jaxphys.core.files import output_file
from jaxphys.pipeline.video import write_picture


def paint_file(
    prompt: str,
    out: Path,
    *,
    prior: str,
    negative: str,
    seed: int,
    overwrite: bool = False,
    **settings: Any,
) -> None:
    """Writes `prompt` painted by a Stable Diffusion, given by name or folder, as the .png `out`.

    `settings` are those of `PaintConfig`. Raises InputError for a bad setting, another extension,
    a file that is there and not to be overwritten, or weights that cannot be had, before anything
    is computed.
    """
    from jaxphys.guidance.choice import image_folder
    from jaxphys.guidance.published.text_to_image import PaintConfig, paint

    if out.suffix.lower() != ".png":
        raise InputError(f"--out {out}: must end in .png")
    output_file(out, overwrite=overwrite)
    check_number("--seed", seed, SEED)
    try:
        config = PaintConfig(**settings)
    except InputError as error:
        raise InputError(f"--{error}") from None
    folder = image_folder(prior, dtype=config.dtype)
    write_picture(out, paint(prompt, folder, negative=negative, seed=seed, config=config))
