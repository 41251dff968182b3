"""Point-E told a prompt: its weights and the CLIP text tower that reads for it."""

from pathlib import Path

import jax.numpy as jnp
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json
from jaxphys.guidance.guides import object_of
from jaxphys.guidance.published.point_e import PointEGuide, load_point_e
from jaxphys.networks.clip_config import TextConfig
from jaxphys.networks.clip_text import ClipText, load_clip_text
from jaxphys.networks.clip_tokenizer import ClipTokenizer
from jaxphys.weights.safetensors_files import open_arrays

CLIP = "clip-vit-large-patch14"
BASE, UPSAMPLER = "base_40m_textvec", "upsample_40m"


def point_e_guide(
    prompt: str, folder: Path, clip: Path, *, dtype: jnp.dtype | str = jnp.float32
) -> PointEGuide:
    """The guide of a refined prompt, of which Point-E is told the object alone: it knows simple
    descriptions only.

    Args:
        prompt: refined.
        folder: holds `base_40m_textvec` and, for clouds of more than 1,024 points, `upsample_40m`,
            as .pt or .safetensors.
        clip: folder of CLIP ViT-L/14.
        dtype: of Point-E's weights and computation.

    Raises:
        InputError: a file is missing, damaged, or of another network.
    """
    prior = load_point_e(*files(folder), dtype=dtype)
    return PointEGuide(prior, text_embedding(clip, object_of(prompt)))


def text_embedding(clip: Path, text: str) -> Array:
    """The unit embedding (768,) of a text, float32. The tower is read, used once and dropped."""
    source = clip / "config.json"
    config = TextConfig.from_json(read_json(source), str(source))
    tower = load_clip_text(open_arrays(clip), config, str(clip))
    ids = jnp.asarray(ClipTokenizer(clip)([text]))
    embedding = _embed(tower, ids)[0]
    return embedding / jnp.linalg.norm(embedding)


@nnx.jit
def _embed(tower: ClipText, ids: Array) -> Array:
    return tower(ids)


def files(folder: Path) -> tuple[Path, Path]:
    """The base and the upsampler in a folder. Raises InputError if one is missing."""
    return _file(folder, BASE), _file(folder, UPSAMPLER)


def _file(folder: Path, stem: str) -> Path:
    for suffix in (".safetensors", ".pt"):
        if (folder / f"{stem}{suffix}").is_file():
            return folder / f"{stem}{suffix}"
    raise InputError(f"{folder}: holds neither {stem}.pt nor {stem}.safetensors")
