"""What a language model's files hold: a .gguf file, or a folder as Hugging Face publishes them."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tokenizers import Tokenizer

from jaxphys.core.errors import InputError
from jaxphys.core.files import read_json
from jaxphys.core.reading import reading
from jaxphys.networks.llama_config import LlamaConfig
from jaxphys.weights.gguf_file import read_gguf
from jaxphys.weights.gguf_tokenizer import tokenizer_from_gguf
from jaxphys.weights.safetensors_files import open_arrays

TURN, END_OF_TURN = "<|im_start|>", "<|im_end|>"


# Types of a GGUF file's tokens that are parts of texts; the others are marks, or fill the table up.
NORMAL, USER_DEFINED, BYTE = 1, 4, 6


class LanguageFiles(NamedTuple):
    """What files hold of a language model.

    Attributes:
        ends: ids of the tokens after which an answer is over.
        sayable: ids of the tokens that an answer may be made of: no marks, no rows of the
            network's table that stand for nothing.
    """

    name: str
    config: LlamaConfig
    arrays: Mapping[str, np.ndarray]
    tokenizer: Tokenizer
    ends: frozenset[int]
    sayable: frozenset[int]


def open_language_files(path: str | Path) -> LanguageFiles:
    """Configuration, arrays (each read when it is asked for) and tokenizer.

    Args:
        path: a .gguf file, a folder with nothing but one, or one with config.json, tokenizer.json
            and safetensors.

    Raises:
        InputError: something is missing, damaged or not supported, or the model was not trained on
            conversations in the ChatML form.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: is missing; give a .gguf file or a folder with config.json")
    if not path.is_dir():
        return _from_gguf(path)
    files = sorted(path.glob("*.gguf"))
    if (path / "config.json").exists() or not files:
        return _from_folder(path)
    if len(files) > 1:
        raise InputError(f"{path}: holds {len(files)} .gguf files; name the one to read")
    return _from_gguf(files[0])


def _from_gguf(path: Path) -> LanguageFiles:
    file = read_gguf(path)
    config = LlamaConfig.from_gguf(file.metadata, str(path))
    config = dataclasses.replace(config, tie_word_embeddings="lm_head.weight" not in file.arrays)
    tokenizer = tokenizer_from_gguf(file.metadata, str(path))
    types = enumerate(file.metadata["tokenizer.ggml.token_type"])
    return _language_files(
        path.stem,
        config,
        file.arrays,
        tokenizer,
        {token for token, kind in types if kind in (NORMAL, USER_DEFINED, BYTE)},
        [file.metadata.get("tokenizer.ggml.eos_token_id")],
        file.metadata.get("tokenizer.chat_template"),
        str(path),
    )


def _from_folder(path: Path) -> LanguageFiles:
    values = read_json(path / "config.json")
    config = LlamaConfig.from_json(values, str(path / "config.json"))
    file = path / "tokenizer.json"
    with reading(file):
        try:
            tokenizer = Tokenizer.from_buffer(file.read_bytes())
        except OSError:
            raise  # told by the border
        except Exception as error:  # the package raises nothing more special
            raise InputError(f"is no tokenizer ({error}); get it again") from None
    tokenizer.no_truncation()
    tokenizer.no_padding()
    template, written = None, path / "chat_template.jinja"
    if written.exists():
        template = written.read_text(encoding="utf-8", errors="replace")
    elif (path / "tokenizer_config.json").exists():
        template = read_json(path / "tokenizer_config.json").get("chat_template")
    generation = path / "generation_config.json"
    known = read_json(generation) if generation.exists() else {}
    ends = [end for found in (values, known) for end in _list(found.get("eos_token_id"))]
    added = tokenizer.get_added_tokens_decoder()
    marks = {token for token, mark in added.items() if mark.special}
    sayable = set(tokenizer.get_vocab().values()) - marks
    return _language_files(
        path.name, config, open_arrays(path), tokenizer, sayable, ends, template, str(path)
    )


def _list(value: Any) -> list:
    return value if isinstance(value, list) else [value]


def _language_files(
    name: str,
    config: LlamaConfig,
    arrays: Mapping[str, np.ndarray],
    tokenizer: Tokenizer,
    sayable: set[int],
    ends: list,
    template: Any,
    source: str,
) -> LanguageFiles:
    found = [tokenizer.token_to_id(mark) for mark in (TURN, END_OF_TURN)]
    marks = [mark for mark in found if mark is not None]
    if len(marks) < len(found) or (isinstance(template, str) and TURN not in template):
        raise InputError(
            f"{source}: is not made for conversations in the ChatML form ({TURN} ... {END_OF_TURN})"
        )
    tokens = max(tokenizer.get_vocab().values()) + 1
    if tokens > config.vocab_size:
        raise InputError(
            f"{source}: the tokenizer has {tokens} tokens, the network {config.vocab_size};"
            " they do not belong together"
        )
    known = {end for end in ends if isinstance(end, int) and 0 <= end < config.vocab_size}
    over = frozenset({*known, *marks})
    return LanguageFiles(name, config, arrays, tokenizer, over, frozenset(sayable) - over)
