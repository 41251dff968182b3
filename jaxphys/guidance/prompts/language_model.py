"""A small language model that answers in this process: weights, tokenizer and sampling.

One block of the network is compiled, and called once for each layer: that compiles ten times
faster than the whole network in one program, and calls cost little beside the block's work.
Texts are given room in powers of two, and by the 256 from there on, so that few lengths are
compiled and little is read that holds nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self, cast

import jax
import jax.numpy as jnp
import numpy as np
from flax import nnx
from jax import Array

from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts.language_files import (
    END_OF_TURN,
    TURN,
    LanguageFiles,
    open_language_files,
)
from jaxphys.networks.joined import JoinedArrays
from jaxphys.networks.llama import JOINED, Cache, Llama, LlamaBlock, empty_cache
from jaxphys.networks.parameters import fill

SMALLEST_ROOM, ROOM = 64, 256
FREE = ", a an the and with of"  # may be repeated
IGNORED = (r"model\.layers\.\d+\.self_attn\.rotary_emb\.inv_freq",)


class Message(NamedTuple):
    """A turn of a conversation; `role` is system, user or assistant."""

    role: str
    content: str


@dataclass(frozen=True)
class Sampling:
    """How the next token is chosen.

    Attributes:
        temperature: 0 takes the likeliest, 1 draws by probability.
        seed: of what is drawn.
        penalty: taken off a token's logarithmic probability each time that it has been drawn, so
            that the answer does not go in circles; commas and articles are free.
        plausible: tokens of less than this part of the likeliest one's probability are not drawn
            (Li et al. 2023).
        guidance: how far to go from what would be said without the request to what is said with
            it; 1 is there, more exaggerates (classifier-free guidance, Sanchez et al. 2023).
    """

    temperature: float = 0.0
    seed: int = 0
    penalty: float = 0.0
    plausible: float = 0.0
    guidance: float = 1.0


class _Text(NamedTuple):
    """A text that was read: its length, what the network has to say of the next token (width,),
    and the cache.
    """

    length: int
    hidden: Array
    cache: Cache


def _room(tokens: int) -> int:
    return max(SMALLEST_ROOM, min(1 << (tokens - 1).bit_length(), -(-tokens // ROOM) * ROOM))


def _compiled(
    module: nnx.Module, call: Callable, donate: Sequence[int] = ()
) -> tuple[Callable, list[Array]]:
    """`call` with a module like this one as its first argument, compiled, and what to pass in the
    module's place: its arrays alone. Passing modules would cost more than the work itself, which
    for one token is a millisecond a layer.
    """
    graph, state = nnx.split(module)
    leaves, structure = jax.tree.flatten(state)

    def merged(leaves: list[Array], *arguments):
        return call(nnx.merge(graph, jax.tree.unflatten(structure, leaves)), *arguments)

    return jax.jit(merged, donate_argnums=donate), leaves


def _embed(outside: Llama, ids: Array) -> Array:
    return outside.model.embed(ids)


def _pass(
    block: LlamaBlock, x: Array, cache: tuple[Array, Array], start: Array
) -> tuple[Array, tuple[Array, Array]]:
    return block(x, cache, start + jnp.arange(x.shape[1]))


def _draw(
    outside: Llama,
    hidden: tuple[Array, ...],
    bias: Array,
    sampling: tuple[Array, Array, Array],
    key: Array,
    index: Array,
) -> Array:
    """The next token, from what (width,) follows the text, and the text without the request if
    there is one.
    """
    temperature, plausible, guidance = sampling
    # One by one: a product with a vector is several times faster than one with two rows.
    rows = [jax.nn.log_softmax(outside.logits(outside.model.norm(row))) for row in hidden]
    with_it, without_it = rows[0], rows[-1]
    logits = without_it + guidance * (with_it - without_it) + bias
    logits = jnp.where(with_it < with_it.max() + jnp.log(plausible), -jnp.inf, logits)
    # By the Gumbel-max trick a draw is a maximum; at temperature 0 the likeliest token remains.
    noise = jax.random.gumbel(jax.random.fold_in(key, index), logits.shape, logits.dtype)
    return jnp.argmax(logits + temperature * noise)


class LanguageModel:
    """A Llama network trained on conversations in the ChatML form, and its tokenizer."""

    def __init__(self, files: LanguageFiles, model: Llama):
        """Takes the model over: its layers are moved out of it."""
        self.name = files.name
        self.config = files.config
        self._tokenizer = files.tokenizer
        # What a user writes never becomes a mark, whatever it looks like.
        self._tokenizer.encode_special_tokens = True
        self._ends, self._sayable = files.ends, files.sayable
        blocks = list(model.model.layers)
        self._pass, _ = _compiled(blocks[0], _pass, donate=[2])
        self._blocks = [jax.tree.leaves(nnx.state(block)) for block in blocks]
        model.model.layers = nnx.List([])
        self._embed, self._outside = _compiled(model, _embed)
        self._draw, _ = _compiled(model, _draw)
        self._free = frozenset(self._ids(FREE))
        self._dtype = jnp.promote_types(model.model.embed_tokens.table[...].dtype, jnp.float32)
        self._read_before: dict[tuple[int, ...], _Text] = {}

    @classmethod
    def load(cls, path: str | Path, dtype: jnp.dtype | str = jnp.float32) -> Self:
        """From a .gguf file, or a folder with config.json, tokenizer.json and safetensors.

        Args:
            path: the file or folder.
            dtype: in which the weights are held, which decides the memory. Activations are
                float32 in any case, and on CPUs float32 weights are also the fastest.

        Raises:
            InputError: the files are missing, damaged, or of a kind that is not supported.
        """
        found = open_language_files(path)
        ignore = (*IGNORED, r"lm_head\.weight") if found.config.tie_word_embeddings else IGNORED
        arrays = JoinedArrays(found.arrays, JOINED, source=str(path))
        model = fill(
            lambda: Llama(found.config), arrays, source=str(path), ignore=ignore, dtype=dtype
        )
        return cls(found, model)

    def _ids(self, text: str) -> list[int]:
        return self._tokenizer.encode(text, add_special_tokens=False).ids

    def conversation(self, messages: Sequence[Message], begin: str = "") -> list[int]:
        """Token ids of the turns in the ChatML form, up to where the assistant's answer goes on
        after `begin`.
        """
        marks = (self._tokenizer.token_to_id(mark) for mark in (TURN, END_OF_TURN))
        turn, end = (cast(int, mark) for mark in marks)  # `LanguageFiles` has both
        ids: list[int] = []
        for role, content in messages:
            ids += [turn, *self._ids(f"{role}\n{content}"), end, *self._ids("\n")]
        return [*ids, turn, *self._ids(f"assistant\n{begin}")]

    def _run(self, ids: np.ndarray, cache: Cache, start: int) -> tuple[Array, Cache]:
        x, updated = self._embed(self._outside, ids[None]), []
        for block, held in zip(self._blocks, cache, strict=True):
            x, held = self._pass(block, x, held, start)
            updated.append(held)
        return x[0], tuple(updated)

    def _read(self, ids: list[int], longest: int) -> _Text:
        """A text in one pass, with room for `longest` tokens. The last two are remembered, so that
        another answer to the same costs nothing.
        """
        capacity, known = _room(max(_room(len(ids)), longest)), (*ids, longest)
        if known not in self._read_before:
            padded = np.zeros(_room(len(ids)), np.int32)
            padded[: len(ids)] = ids
            cache = empty_cache(self.config, capacity, dtype=self._dtype)
            rows, cache = self._run(padded, cache, 0)
            latest = list(self._read_before.items())[-1:]
            text = _Text(len(ids), rows[len(ids) - 1], cache)
            self._read_before = dict([*latest, (known, text)])
        text = self._read_before[known]
        return text._replace(cache=jax.tree.map(jnp.copy, text.cache))  # `_run` uses it up

    def answer(
        self,
        messages: Sequence[Message],
        *,
        max_tokens: int = 128,
        begin: str = "",
        until: Callable[[str], bool] | None = None,
        only: str | None = None,
        without: Sequence[Message] | None = None,
        begin_without: str = "",
        sampling: Sampling = Sampling(),
    ) -> str:
        """The assistant's answer, the same every time for the same arguments.

        Args:
            messages: the conversation so far.
            max_tokens: after so many the answer is cut off.
            begin: words that the answer is made to begin with; they are part of it.
            until: the answer ends before it would become a text (less `begin`) of which this is
                true.
            only: a text of whose tokens the answer must consist, to choose from what was said.
            without, begin_without: the conversation without the request and what its answer is made
                to begin with, for guidance. Costs as much again.
            sampling: how tokens are chosen.

        Raises:
            InputError: the conversation and the answer are longer than the model can read.
        """
        ids = [self.conversation(messages, begin)]
        if without is not None:
            ids.append(self.conversation(without, begin_without))
        longest = max(map(len, ids)) + max_tokens
        if longest > self.config.max_position_embeddings:
            raise InputError(
                f"{self.name}: a conversation with its answer of {longest} tokens is more than the"
                f" {self.config.max_position_embeddings} that the model reads"
            )
        texts = [self._read(text, longest) for text in ids]
        numbers = (sampling.temperature, sampling.plausible, sampling.guidance)
        options = tuple(np.asarray(number, self._dtype) for number in numbers)
        key, bias = jax.random.key(sampling.seed), self._bias(only)
        written: list[int] = []
        answer = ""
        for index in range(max_tokens):
            hidden = tuple(text.hidden for text in texts)
            token = int(self._draw(self._outside, hidden, bias, options, key, index))
            if token in self._ends:
                break
            longer = self._tokenizer.decode([*written, token])
            if until is not None and until(longer):
                break
            written, answer = [*written, token], longer
            if token not in self._free:
                bias[token] -= sampling.penalty
            texts = [self._continued(text, token) for text in texts]
        return begin + answer

    def _continued(self, text: _Text, token: int) -> _Text:
        rows, cache = self._run(np.array([token], np.int32), text.cache, text.length)
        return _Text(text.length + 1, rows[0], cache)

    def _bias(self, only: str | None) -> np.ndarray:
        """What is added to each token's logarithmic probability at first: -inf forbids."""
        allowed = self._sayable if only is None else self._sayable & {*self._ids(only)}
        bias = np.full(self.config.vocab_size, -np.inf, self._dtype)
        bias[[*allowed, *self._ends]] = 0.0
        return bias
