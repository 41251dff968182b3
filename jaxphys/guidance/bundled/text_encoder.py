"""Sentences to unit vectors: MiniLM-L6-v2 (Wang et al. 2020; sentence-transformers), in JAX.

A BERT of 6 layers, width 384, 12 heads, whose token outputs are averaged and normalised. The
bundled weights hold its linear layers in 6 bits and its plain Latin word pieces in 4
(`experiments/priors/text_encoder.py` makes them and measures what that costs).
"""

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, NamedTuple, cast

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from jaxphys import weights
from jaxphys.core.errors import InputError
from jaxphys.guidance.bundled.quantise import Packed, unpack
from jaxphys.guidance.guides import phrases_of

if TYPE_CHECKING:
    from tokenizers import Tokenizer  # slow to import, and not needed by all


NAME = "text_encoder"
WIDTH, HEADS, LAYERS = 384, 12, 6
EPSILON = 1e-12  # of the layer norms
MAXIMUM_TOKENS = 128  # with the two marks; what follows is not read
LINEAR_BITS, LINEAR_GROUP = 6, 128
WORD_BITS, WORD_GROUP = 4, 96
LINEAR = ("query", "key", "value", "attention_output", "expand", "contract")
NORMS = ("attention_norm", "output_norm")


class TextEncoder(NamedTuple):
    """Call it with texts. `layers` holds arrays stacked over the layers, `words` the packed
    vocabulary.
    """

    tokenizer: "Tokenizer"
    words: Packed
    positions: np.ndarray  # (MAXIMUM_TOKENS, 384), the token type's row added
    norm: tuple[np.ndarray, np.ndarray]
    layers: dict[str, Array]

    def __call__(self, texts: Sequence[str]) -> np.ndarray:
        """(B, 384) float32 of unit norm, one row for each of the `texts`.

        Case and accents do not matter. Of a text longer than 126 word pieces only the start is
        read. Lengths and batches are padded to powers of two, so that few programs are compiled.
        """
        if isinstance(texts, str) or not all(isinstance(text, str) for text in texts):
            raise InputError("text encoder: give a list of strings")
        if len(texts) == 0:
            return np.zeros((0, WIDTH), np.float32)
        rows = []
        for start in range(0, len(texts), 64):
            batch = [self._tokens(text) for text in texts[start : start + 64]]
            length = power_of_two(max(map(len, batch)), least=8)
            # A padded row reads one token, so that its mean stays defined.
            mask = np.zeros((power_of_two(len(batch), least=1), length), np.float32)
            mask[:, 0] = 1
            tokens = np.zeros(mask.shape, np.int64)
            for row, ids in enumerate(batch):
                tokens[row, : len(ids)] = ids
                mask[row, : len(ids)] = 1
            embedded = self._embed(tokens)
            rows.append(np.asarray(forward(self.layers, embedded, mask))[: len(batch)])
        return np.concatenate(rows)

    def _tokens(self, text: str) -> list[int]:
        marks = (self.tokenizer.token_to_id(mark) for mark in ("[CLS]", "[SEP]"))
        first, last = (cast(int, mark) for mark in marks)  # its vocabulary has them
        ids = self.tokenizer.encode(text, add_special_tokens=False).ids
        return [first, *ids[: MAXIMUM_TOKENS - 2], last]

    def _embed(self, tokens: np.ndarray) -> np.ndarray:
        """Word, position and type embeddings, normalised: (B, L, 384). Only the words used are
        unpacked.
        """
        distinct, index = np.unique(tokens, return_inverse=True)
        table = unpack(
            Packed(self.words.bits[distinct], self.words.scales[distinct]), WORD_BITS, WORD_GROUP
        )
        total = table[index].reshape(*tokens.shape, WIDTH) + self.positions[: tokens.shape[1]]
        centred = total - total.mean(-1, keepdims=True)
        spread = np.sqrt((centred**2).mean(-1, keepdims=True) + EPSILON)
        scale, shift = self.norm
        return (centred / spread * scale + shift).astype(np.float32)


def power_of_two(count: int, least: int) -> int:
    """The smallest power of two that is at least `count` and `least`."""
    return max(least, 1 << (count - 1).bit_length())


def layer_norm(x: Array, scale: Array, shift: Array) -> Array:
    """Ba et al. 2016, over the last axis."""
    centred = x - x.mean(-1, keepdims=True)
    variance = jnp.square(centred).mean(-1, keepdims=True)
    return centred * jax.lax.rsqrt(variance + EPSILON) * scale + shift


@jax.jit
def forward(layers: dict[str, Array], embedded: Array, mask: Array) -> Array:
    """The transformer, the mean over tokens and the normalisation: (B, L, 384), (B, L) -> (B,
    384).
    """
    batch, length, width = embedded.shape
    bias = jnp.where(mask > 0, 0.0, -1e9).astype(embedded.dtype)[:, None, None, :]

    def linear(layer, name, x):
        product = jnp.einsum("...i,oi->...o", x, layer[name], precision="highest")
        return product + layer[f"{name}_bias"]

    def body(x, layer):
        query, key, value = (
            linear(layer, name, x).reshape(batch, length, HEADS, width // HEADS)
            for name in ("query", "key", "value")
        )
        logits = jnp.einsum("bqhd,bkhd->bhqk", query, key, precision="highest")
        attention = jax.nn.softmax(logits * (width // HEADS) ** -0.5 + bias, axis=-1)
        mixed = jnp.einsum("bhqk,bkhd->bqhd", attention, value, precision="highest")
        mixed = linear(layer, "attention_output", mixed.reshape(x.shape))
        x = layer_norm(x + mixed, layer["attention_norm"], layer["attention_norm_bias"])
        hidden = jax.nn.gelu(linear(layer, "expand", x), approximate=False)
        x = x + linear(layer, "contract", hidden)
        return layer_norm(x, layer["output_norm"], layer["output_norm_bias"]), None

    tokens, _ = jax.lax.scan(body, embedded, layers)
    total = (tokens * mask[..., None]).sum(1) / mask.sum(1, keepdims=True)
    return total / jnp.linalg.norm(total, axis=-1, keepdims=True)


def make_tokenizer(vocabulary: Sequence[str]) -> "Tokenizer":
    """BERT's uncased word pieces over `vocabulary`, whose order gives the ids."""
    from tokenizers import Tokenizer, models, normalizers, pre_tokenizers

    index = {piece: number for number, piece in enumerate(vocabulary)}
    tokenizer = Tokenizer(models.WordPiece(index, unk_token="[UNK]"))
    tokenizer.normalizer = normalizers.BertNormalizer(lowercase=True)
    tokenizer.pre_tokenizer = pre_tokenizers.BertPreTokenizer()
    return tokenizer


def from_arrays(arrays: dict[str, np.ndarray]) -> TextEncoder:
    """The encoder from the arrays of the bundled file."""
    layers = {}
    for name in LINEAR:
        layers[name] = np.stack(
            [
                unpack(
                    Packed(arrays[f"{i}.{name}.bits"], arrays[f"{i}.{name}.scales"]),
                    LINEAR_BITS,
                    LINEAR_GROUP,
                )
                for i in range(LAYERS)
            ]
        )
        layers[f"{name}_bias"] = np.stack([arrays[f"{i}.{name}.bias"] for i in range(LAYERS)])
    for name in NORMS:
        layers[name] = np.stack([arrays[f"{i}.{name}.scale"] for i in range(LAYERS)])
        layers[f"{name}_bias"] = np.stack([arrays[f"{i}.{name}.bias"] for i in range(LAYERS)])
    vocabulary = arrays["vocabulary"].tobytes().decode().split("\n")
    return TextEncoder(
        make_tokenizer(vocabulary),
        Packed(arrays["words.bits"], arrays["words.scales"]),
        arrays["positions"].astype(np.float32),
        (arrays["norm.scale"], arrays["norm.bias"]),
        {name: jnp.asarray(value, jnp.float32) for name, value in layers.items()},
    )


@cache
def load_text_encoder() -> TextEncoder:
    """The bundled encoder, read and checked once a process. Raises InputError if its file is
    damaged.
    """
    arrays, _ = weights.load(NAME)
    return from_arrays(arrays)


def prompt_embeddings(prompt: str, phrases: int) -> Array:
    """(1 + phrases, 384) float32: unit embeddings of the object that a refined prompt names and of
    its other phrases, see `phrases_of`; zeros where there are no more.
    """
    found = load_text_encoder()(phrases_of(prompt, phrases))
    return jnp.zeros((1 + phrases, WIDTH), jnp.float32).at[: len(found)].set(found)
