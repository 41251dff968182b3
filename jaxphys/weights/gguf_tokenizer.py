"""The tokenizer that a GGUF file holds in its metadata, as one of the `tokenizers` package."""

from collections.abc import Mapping
from typing import Any

from tokenizers import AddedToken, Tokenizer, decoders, models, pre_tokenizers

from jaxphys.core.errors import InputError, nearest, shown

CONTROL, USER_DEFINED = 3, 4  # types of tokens that are never made of merges


def _bytes() -> pre_tokenizers.PreTokenizer:
    return pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=True)


# How text is cut before merges are applied. Both cut as GPT-2 does; the SmolLM models take every
# digit by itself before that.
CUTS = {
    "gpt-2": _bytes,
    "smollm": lambda: pre_tokenizers.Sequence(
        [pre_tokenizers.Digits(individual_digits=True), _bytes()]
    ),
}


def tokenizer_from_gguf(metadata: Mapping[str, Any], source: str) -> Tokenizer:
    """Byte-level byte pair encoding (Sennrich et al. 2016, Radford et al. 2019) with the file's
    vocabulary and merges; marks such as `<|im_start|>` are one token each.

    Raises:
        InputError: another kind of tokenizer, or a vocabulary that cannot be one.
    """
    model, cut = (metadata.get(f"tokenizer.ggml.{name}") for name in ("model", "pre"))
    if model != "gpt2":
        raise InputError(
            f"{source}: tokenizer.ggml.model: {shown(model)} is not supported, only 'gpt2'; give"
            " the folder with tokenizer.json that the file was made from"
        )
    if cut not in CUTS:
        raise InputError(f"{source}: tokenizer.ggml.pre: {shown(cut)}; {nearest(str(cut), CUTS)}")
    given: Mapping[str, Any] = {
        name: metadata.get(f"tokenizer.ggml.{name}") for name in ("tokens", "token_type", "merges")
    }
    tokens, types, merges = given["tokens"], given["token_type"], given["merges"]
    for name, entries, kind in (("tokens", tokens, str), ("merges", merges, str)):
        if not isinstance(entries, list) or not all(isinstance(entry, kind) for entry in entries):
            raise InputError(f"{source}: tokenizer.ggml.{name}: expected a list of strings")
    if not isinstance(types, list) or len(types) != len(tokens):
        raise InputError(f"{source}: tokenizer.ggml.token_type: expected one for each token")
    vocabulary = {token: index for index, token in enumerate(tokens)}
    if len(vocabulary) != len(tokens):
        raise InputError(f"{source}: tokenizer.ggml.tokens: a token is there twice")
    pairs = [tuple(merge.split(" ")) for merge in merges]
    for pair in pairs:
        if len(pair) != 2 or not {*pair, "".join(pair)} <= vocabulary.keys():
            raise InputError(
                f"{source}: tokenizer.ggml.merges: {shown(' '.join(pair))} does not join two tokens"
            )
    tokenizer = Tokenizer(models.BPE(vocab=vocabulary, merges=pairs))
    tokenizer.pre_tokenizer = CUTS[cut]()
    tokenizer.decoder = decoders.ByteLevel()
    tokenizer.add_special_tokens(
        [
            AddedToken(token, special=True, normalized=False)
            for token, kind in zip(tokens, types, strict=True)
            if kind in (CONTROL, USER_DEFINED)
        ]
    )
    return tokenizer
