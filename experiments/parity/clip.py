"""CLIP and the LAION aesthetic heads: what transformers and torch compute, names in their files."""

import itertools
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from transformers import CLIPConfig, CLIPModel, CLIPTextConfig, CLIPTextModel, CLIPTokenizer
from transformers.models.clip.image_processing_pil_clip import CLIPImageProcessorPil

from experiments.parity import clip_cases as cases
from experiments.parity.arrays import weights
from experiments.parity.clip_tokenizer import GOLDEN as VOCABULARY
from experiments.parity.clip_tokenizer import STYLES, write_folder

PREFIX = "text_model."


def _text_names(config: dict) -> dict[str, tuple[int, ...]]:
    """Names and shapes of a text encoder as files have them: with the prefix, without buffers."""
    with torch.device("meta"):
        model = CLIPTextModel(CLIPTextConfig(**config))
    named = {name.removeprefix(PREFIX): tensor for name, tensor in model.named_parameters()}
    return {f"{PREFIX}{name}": tuple(tensor.shape) for name, tensor in named.items()}


def _fill(model: torch.nn.Module, arrays: Mapping[str, np.ndarray]) -> torch.nn.Module:
    """The model with these arrays in place of every one of its parameters."""
    tensors = {name: torch.from_numpy(array) for name, array in arrays.items()}
    model.load_state_dict(tensors, strict=True)
    return model.eval()


@torch.no_grad()
def text_tower(config: dict, ids: np.ndarray) -> dict[str, np.ndarray]:
    """Hidden states and pooled rows of a text encoder."""
    model = CLIPTextModel(CLIPTextConfig(**config))
    arrays = weights(_text_names(config))
    if not any(name.startswith(PREFIX) for name in model.state_dict()):
        arrays = {name.removeprefix(PREFIX): array for name, array in arrays.items()}
    output = _fill(model, arrays)(torch.from_numpy(ids))
    return {
        "hidden": output.last_hidden_state.numpy(),
        "pooled": output.pooler_output.numpy(),
    }


@torch.no_grad()
def embeddings() -> dict[str, np.ndarray]:
    """Texts and pictures in the space that they share, of a whole small CLIP, not normalised."""
    model = CLIPModel(CLIPConfig(**cases.WHOLE))
    shapes = {name: tuple(tensor.shape) for name, tensor in model.named_parameters()}
    model = _fill(model, weights(shapes))
    pixels = torch.from_numpy(cases.PIXELS).permute(0, 3, 1, 2)
    return {
        "text": model.get_text_features(torch.from_numpy(cases.IDS["end"])).pooler_output.numpy(),
        "image": model.get_image_features(pixels).pooler_output.numpy(),
    }


@torch.no_grad()
def cosines() -> dict[str, np.ndarray]:
    """Of a sentence and some pictures, from words and uint8 to the end."""
    model = CLIPModel(CLIPConfig(**cases.SCORED))
    model = _fill(model, weights({n: tuple(p.shape) for n, p in model.named_parameters()}))
    with tempfile.TemporaryDirectory() as place:
        merges = json.loads(VOCABULARY.read_text())["merges"]
        tokenizer = CLIPTokenizer.from_pretrained(write_folder(Path(place), merges, STYLES["end"]))
    tokens = tokenizer(cases.SENTENCE, padding="max_length", max_length=77, return_tensors="pt")
    pixels = [
        _prepared(picture, model.config.vision_config.image_size)
        for picture in cases.PICTURES.values()
    ]
    output = model(input_ids=tokens["input_ids"], pixel_values=torch.from_numpy(np.stack(pixels)))
    return {"cosines": (output.image_embeds @ output.text_embeds.T)[:, 0].numpy()}


def _prepared(picture: np.ndarray, size: int) -> np.ndarray:
    side = {"height": size, "width": size}
    processor = CLIPImageProcessorPil(size={"shortest_edge": size}, crop_size=side)
    return np.asarray(processor(picture)["pixel_values"][0])


def pictures() -> dict[str, np.ndarray]:
    """Pictures as the towers read them, (H, W, 3)."""
    return {
        name: _prepared(picture, cases.SIZE).transpose(1, 2, 0)
        for name, picture in cases.PICTURES.items()
    }


@torch.no_grad()
def aesthetic() -> dict[str, np.ndarray]:
    """What both heads give for embeddings of length 1."""
    unit = torch.nn.functional.normalize(torch.from_numpy(cases.EMBEDDINGS), dim=-1)
    linear = _fill(torch.nn.Linear(768, 1), weights(cases.LINEAR_HEAD))
    deep = _fill(DeepHead(), weights(cases.DEEP_HEAD))
    return {"v1": linear(unit)[:, 0].numpy(), "v2": deep(unit)[:, 0].numpy()}


class DeepHead(torch.nn.Module):
    """Linear layers with nothing but dropout between them, as the second head was published."""

    def __init__(self, widths: tuple[int, ...] = (768, 1024, 128, 64, 16, 1)):
        super().__init__()
        linear = [torch.nn.Linear(*pair) for pair in itertools.pairwise(widths)]
        dropout = [torch.nn.Dropout(rate) for rate in (0.2, 0.2, 0.1)]
        self.layers = torch.nn.Sequential(
            linear[0], dropout[0], linear[1], dropout[1], linear[2], dropout[2], *linear[3:]
        )

    def forward(self, embeddings: torch.Tensor) -> torch.Tensor:
        return self.layers(embeddings)


def text_encoder_names(**differences) -> dict[str, tuple[int, ...]]:
    """A published text encoder, with the buffer that was stored beside its parameters."""
    names = _text_names({"projection_dim": 768} | differences)
    return dict(sorted((names | {f"{PREFIX}embeddings.position_ids": (1, 77)}).items()))


def clip_names() -> dict[str, tuple[int, ...]]:
    """openai/clip-vit-large-patch14, with its two buffers."""
    text = {"hidden_size": 768, "intermediate_size": 3072, "num_attention_heads": 12}
    vision = {
        "hidden_size": 1024, "intermediate_size": 4096, "num_attention_heads": 16,
        "num_hidden_layers": 24, "patch_size": 14,
    }  # fmt: skip
    with torch.device("meta"):
        model = CLIPModel(CLIPConfig(text_config=text, vision_config=vision, projection_dim=768))
    names = {name: tuple(tensor.shape) for name, tensor in model.named_parameters()}
    names["text_model.embeddings.position_ids"] = (1, 77)
    names["vision_model.embeddings.position_ids"] = (1, 257)
    return dict(sorted(names.items()))


def head_names(head: torch.nn.Module) -> dict[str, tuple[int, ...]]:
    """Of an aesthetic head."""
    return {name: tuple(tensor.shape) for name, tensor in head.state_dict().items()}


GOLDEN = {
    "clip_text_end": lambda: text_tower(cases.END_PADDED, cases.IDS["end"]),
    "clip_text_zero": lambda: text_tower(cases.ZERO_PADDED, cases.IDS["zero"]),
    "clip_embeddings": embeddings,
    "clip_pictures": pictures,
    "clip_cosines": cosines,
    "laion_aesthetic": aesthetic,
}
MANIFESTS = {
    "sd15_text_encoder": lambda: text_encoder_names(
        hidden_size=768, intermediate_size=3072, num_attention_heads=12
    ),
    "sd21_text_encoder": lambda: text_encoder_names(
        hidden_size=1024, intermediate_size=4096, num_attention_heads=16, num_hidden_layers=23
    ),
    "clip_vit_large_patch14": clip_names,
    "laion_aesthetic_v1": lambda: head_names(torch.nn.Linear(768, 1)),
    "laion_aesthetic_v2": lambda: head_names(DeepHead()),
}
