"""The catalogue is consistent in itself, and with what loads its files."""

import re
from pathlib import PurePosixPath

import pytest

from jaxphys.core.errors import InputError
from jaxphys.evaluate.aesthetic import HEADS
from jaxphys.guidance.published.point_e_guide import BASE, CLIP, UPSAMPLER
from jaxphys.guidance.published.stable_diffusion import PARTS
from jaxphys.weights import manifest
from jaxphys.weights.catalogue import CATALOGUE, find_entry, halved

FILES = [
    (entry, file)
    for entry in CATALOGUE.values()
    for file in (*entry.files, *entry.half, *entry.instead)
]


@pytest.mark.parametrize(("entry", "file"), FILES, ids=[f"{e.name}/{f.path}" for e, f in FILES])
def test_files_are_well_formed(entry, file):
    path = PurePosixPath(file.path)
    assert not path.is_absolute() and ".." not in path.parts and str(path) == file.path
    assert file.size > 0
    assert file.sha256 is None or re.fullmatch("[0-9a-f]{64}", file.sha256)
    assert file.url is None or file.url.startswith("https://")


@pytest.mark.parametrize("entry", CATALOGUE.values(), ids=list(CATALOGUE))
def test_entries_are_complete(entry):
    paths = [file.path for file in (*entry.files, *entry.half, *entry.instead)]
    assert len(set(paths)) == len(paths)
    assert entry.purpose and entry.licence
    assert all(re.fullmatch(r"[\w.-]+/[\w.-]+", name) for name in entry.repositories)
    # It can be had from somewhere, whole.
    assert entry.repositories or all(file.url for file in entry.files)
    assert bool(entry.instead) <= bool(entry.repositories)
    for file in entry.half:
        assert file.path.replace(".fp16", "") in {full.path for full in entry.files}


def test_names_and_aliases_are_each_of_one_network():
    names = [name for entry in CATALOGUE.values() for name in (entry.name, *entry.aliases)]
    assert len(set(names)) == len(names)
    assert not set(names) & set(manifest())
    assert find_entry("stable-diffusion") is CATALOGUE["stable-diffusion-1.5"]
    assert all(find_entry(name).name == name for name in CATALOGUE)


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'stable-diffusion"):
        find_entry("stable-difusion")


def test_deleted_repositories_come_last():
    for name in ("stable-diffusion-1.5", "stable-diffusion-2.1-base", "stable-diffusion-2.1"):
        living, deleted = CATALOGUE[name].repositories
        assert living.split("/")[0] in ("stable-diffusion-v1-5", "sd2-community")
        assert deleted.split("/")[0] in ("runwayml", "stabilityai")


def test_the_aesthetic_heads_are_those_that_are_scored_with():
    for entry, path, _ in HEADS.values():
        assert [file.path for file in CATALOGUE[entry].files] == [path]


def test_stable_diffusion_has_every_part():
    for name in ("stable-diffusion-1.5", "stable-diffusion-2.1-base", "stable-diffusion-2.1"):
        parts = {file.path.split("/")[0] for file in CATALOGUE[name].files}
        assert parts == set(PARTS)


def test_stable_diffusion_is_published_at_half_precision():
    for name in ("stable-diffusion-1.5", "stable-diffusion-2.1-base", "stable-diffusion-2.1"):
        entry = CATALOGUE[name]
        small = halved(entry, entry.files)
        assert set(entry.half) <= set(small) and len(small) == len(entry.files)
        sizes = [sum(file.size for file in files) for files in (small, entry.files)]
        assert sizes[0] < 0.51 * sizes[1]


def test_point_e_s_files_are_those_that_are_loaded():
    assert [file.path for file in CATALOGUE["point-e"].files] == [f"{BASE}.pt", f"{UPSAMPLER}.pt"]
    assert CLIP in CATALOGUE
