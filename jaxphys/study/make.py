"""A study's folder: `page/` to hand out, and the key, which stays at home."""

import hashlib
import json
import os
import re
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jaxphys.core.errors import InputError, shown
from jaxphys.core.files import atomic_path, write_json
from jaxphys.core.run_folder import run_folder
from jaxphys.study.config import Study, clip_file, read_study
from jaxphys.study.design import Page, assigned
from jaxphys.study.study_page import blinded, study_page

KEY, PAGE = "key.json", "page/index.html"
KEY_FORMAT, KEY_VERSION = "jaxphys-study-key", 1


def make_study(
    config: str | os.PathLike, out: str | os.PathLike, *, overwrite: bool = False
) -> Path:
    """Makes the page and the key of a study; returns its folder.

    The folder gets `page/index.html` and `page/clips/`, to be handed out together, and `key.json`,
    which says what was shown and must not be.

    Args:
        config: the study's file; clips are relative to it.
        out: the folder: new, empty, or of the same study.
        overwrite: whether the files of another study in `out` may be replaced.

    Raises:
        InputError: the study or a clip cannot be used, a text would tell a method's name, or `out`
            cannot be written.
    """
    config = Path(config)
    study = read_study(config)
    _require_blind(study)
    names = blinded(study)
    files = {
        clip: clip_file(study, clip[0], study.methods[clip[1]], config.parent) for clip in names
    }
    seats = assigned(study)
    identity = _identity(study, [files[clip] for clip in sorted(files)])
    made = [KEY, PAGE, *(f"page/clips/{name}" for name in names.values())]
    inputs = (config, *files.values())
    with run_folder(out, identity, made, inputs=inputs, overwrite=overwrite) as folder:
        for clip, name in names.items():
            with atomic_path(folder.file(f"page/clips/{name}")) as aside:
                shutil.copyfile(files[clip], aside)
        with atomic_path(folder.file(PAGE)) as aside:
            aside.write_text(study_page(study, seats, identity[:16]), encoding="utf-8")
        write_json(folder.file(KEY), key_of(study, seats, identity[:16]))
        return folder.path


def key_of(study: Study, seats: list[list[Page]], identity: str) -> dict[str, Any]:
    """What was shown on which page, for JSON."""
    return {
        "format": KEY_FORMAT,
        "version": KEY_VERSION,
        "study": identity,
        "questions": [{"name": one.name, "kind": one.kind} for one in study.questions],
        "items": [item.name for item in study.items],
        "methods": study.methods,
        "seats": [[asdict(page) for page in pages] for pages in seats],
    }


def _identity(study: Study, files: list[Path]) -> str:
    """SHA-256 of all that decides the study."""
    digest = hashlib.sha256(json.dumps(asdict(study), sort_keys=True).encode())
    for path in files:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _require_blind(study: Study) -> None:
    read = {"title": study.title, "consent": study.consent}
    for i, question in enumerate(study.questions):
        for part in ("text", "low", "high"):
            read[f"questions[{i}].{part}"] = getattr(question, part)
    read |= {f"items[{i}].prompt": item.prompt for i, item in enumerate(study.items)}
    for where, text in read.items():
        for method in study.methods:
            if re.search(rf"(?<!\w){re.escape(method)}(?!\w)", text, re.IGNORECASE):
                raise InputError(
                    f"{where}: tells raters the name of the method {shown(method)}; word it"
                    " otherwise, or name the method otherwise"
                )
