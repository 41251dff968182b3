"""Files are found where they may be, in order, and never fetched where they must not."""

import pwd
import sys
from pathlib import Path

import pytest

from jaxphys.core.errors import InputError
from jaxphys.weights.catalogue import CATALOGUE, Entry, File
from jaxphys.weights.places import hub_cache
from jaxphys.weights.resolve import locate

LIVING, DELETED = "people/net", "company/net"
FILES = ("unet/net.safetensors", "vae/net.safetensors", "tokenizer/vocab.json", "head.pt")


@pytest.fixture(autouse=True)
def entry(monkeypatch):
    """A network of four files."""
    files = tuple(File(path, 5) for path in FILES)
    made = Entry("net", "a test", "MIT", files, aliases=("alias",), repositories=(LIVING, DELETED))
    monkeypatch.setitem(CATALOGUE, "net", made)
    return made


@pytest.fixture
def environment(tmp_path):
    """Nothing anywhere, and no network."""
    return {
        "JAXPHYS_WEIGHTS": str(tmp_path / "weights"),
        "HF_HUB_CACHE": str(tmp_path / "hub"),
        "HF_HUB_OFFLINE": "1",
    }


def write(folder: Path, paths=FILES) -> Path:
    for path in paths:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(b"12345")
    return folder


def snapshot(tmp_path, repository, paths=FILES, commit="c0ffee", main=True) -> Path:
    """A revision in the hub's cache, which consists of links."""
    folder = tmp_path / "hub" / f"models--{repository.replace('/', '--')}"
    blob = write(folder, ["blobs/1"]) / "blobs/1"
    for path in paths:
        link = folder / "snapshots" / commit / path
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(blob)
    if main:
        (folder / "refs").mkdir(exist_ok=True)
        (folder / "refs/main").write_text(commit)
    return folder / "snapshots" / commit


def refused(match, *arguments, **options):
    with pytest.raises(InputError, match=match) as error:
        locate(*arguments, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_folder_that_is_given_is_taken_by_name_and_alias(tmp_path, environment):
    write(tmp_path / "mine")
    assert locate("net", tmp_path / "mine", environment=environment) == tmp_path / "mine"
    assert locate("alias", str(tmp_path / "mine"), environment=environment) == tmp_path / "mine"


def test_a_file_that_is_given_stands_for_its_folder(tmp_path, environment):
    write(tmp_path / "mine")
    assert locate("net", tmp_path / "mine/head.pt", environment=environment) == tmp_path / "mine"


def test_a_folder_that_is_given_and_lacks_a_file_is_an_error(tmp_path, environment):
    """Even where another place has everything."""
    write(tmp_path / "weights/net")
    write(tmp_path / "mine", FILES[1:])
    message = refused("mine: lacks unet/net.safetensors", "net", tmp_path / "mine")
    assert "vae" not in message and f"huggingface.co/{LIVING}" in message
    refused("no such file or folder", "net", tmp_path / "none", environment=environment)


def test_places_in_order(tmp_path, environment):
    def found():
        return locate("net", environment=environment)

    deleted = snapshot(tmp_path, DELETED)
    assert found() == deleted
    old = snapshot(tmp_path, LIVING, commit="0ld", main=False)
    assert found() == old
    new = snapshot(tmp_path, LIVING, commit="1new")
    assert found() == new
    mine = write(tmp_path / "weights/net")
    assert found() == mine


def test_the_name_of_the_folder_is_the_networks_and_no_alias(tmp_path, environment):
    write(tmp_path / "weights/net")
    assert locate("alias", environment=environment) == tmp_path / "weights/net"


def test_a_place_that_lacks_a_file_is_passed_over(tmp_path, environment):
    write(tmp_path / "weights/net", FILES[:-1])
    whole = snapshot(tmp_path, DELETED)
    assert locate("net", environment=environment) == whole


def test_only_the_parts_that_are_asked_for_are_needed(tmp_path, environment):
    folder = write(tmp_path / "weights/net", ["unet/net.safetensors", "head.pt"])
    options = {"environment": environment}
    assert locate("net", parts=("unet", "head.pt"), **options) == folder
    message = refused("vae/net.safetensors", "net", parts=("unet", "vae"), **options)
    assert "tokenizer" not in message
    refused("no file of it starts with", "net", parts=("audio",), **options)
    message = refused("JAXPHYS_WEIGHTS", "net", parts=("",), **options)
    assert "vae" in message and "tokenizer" in message and "head.pt" not in message


@pytest.mark.parametrize(
    ("path", "other"),
    [
        ("unet/net.safetensors", "unet/net.fp16.safetensors"),
        ("unet/net.safetensors", "unet/net.safetensors.index.json"),
        ("tokenizer/vocab.json", "tokenizer/tokenizer.json"),
        ("head.pt", "head.safetensors"),
    ],
)
def test_what_stands_for_a_file(tmp_path, environment, path, other):
    folder = write(tmp_path / "weights/net", [other if p == path else p for p in FILES])
    assert locate("net", environment=environment) == folder
    (folder / other).unlink()
    refused(f"missing {path}", "net", environment=environment)


def test_another_set_of_files_that_serves_as_well(tmp_path, environment, monkeypatch):
    other = (File("model.safetensors", 5), File("config.json", 5))
    made = Entry("two", "", "", (File("a.gguf", 5),), repositories=(LIVING,), instead=other)
    monkeypatch.setitem(CATALOGUE, "two", made)
    snapshot(tmp_path, LIVING, ["config.json"])
    refused(r"missing a\.gguf", "two", environment=environment)
    whole = snapshot(tmp_path, LIVING, ["config.json", "model.safetensors"], commit="whole")
    assert locate("two", environment=environment) == whole
    mine = write(tmp_path / "weights/two", ["a.gguf"])
    assert locate("two", environment=environment) == mine


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"HF_HUB_CACHE": "/a", "HF_HOME": "/b"}, "/a"),
        ({"HUGGINGFACE_HUB_CACHE": "/a", "HF_HOME": "/b"}, "/a"),
        ({"HF_HOME": "/b", "XDG_CACHE_HOME": "/c"}, "/b/hub"),
        ({"XDG_CACHE_HOME": "/c"}, "/c/huggingface/hub"),
        ({}, "~/.cache/huggingface/hub"),
    ],
)
def test_the_hubs_cache_is_where_its_library_has_it(variables, expected):
    assert hub_cache(variables) == Path(expected).expanduser()


def test_without_a_variable_weights_are_in_the_users_cache(tmp_path, environment, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    del environment["JAXPHYS_WEIGHTS"]
    folder = write(tmp_path / ".cache/jaxphys/weights/net")
    assert locate("net", environment=environment) == folder


def test_an_installed_package_is_found_and_not_run(tmp_path, environment, monkeypatch):
    made = Entry("packed", "", "", (File("a.gguf", 5),), package="my-weights==1.0")
    monkeypatch.setitem(CATALOGUE, "packed", made)
    package = write(tmp_path / "site/my_weights", ["a.gguf"])
    (package / "__init__.py").write_text("raise RuntimeError('this must not be run')")
    refused("my-weights==1.0", "packed", fetch=False, environment=environment)
    monkeypatch.syspath_prepend(tmp_path / "site")
    assert locate("packed", environment=environment) == package
    assert "my_weights" not in sys.modules


def test_the_suite_does_not_see_the_weights_of_this_computer():
    refused("not on this computer", "smollm2")
    refused("not on this computer", "stable-diffusion")


def test_what_is_missing_is_told_with_everything_that_helps(environment, tmp_path):
    message = refused("HF_HUB_OFFLINE", "net", environment=environment)
    folder = tmp_path / "weights/net"
    for part in (*FILES, "(5 B)", "MIT", LIVING, str(folder), "$JAXPHYS_WEIGHTS", "weights fetch"):
        assert part in message
    assert not folder.exists()


def test_nothing_is_fetched_unasked(environment):
    del environment["HF_HUB_OFFLINE"]
    environment["HF_ENDPOINT"] = "http://127.0.0.1:9"
    refused("nothing was fetched", "net", fetch=False, environment=environment)


def test_an_unknown_name(environment):
    refused("unknown name 'nett'; did you mean 'net'", "nett", environment=environment)


def test_without_a_home_directory(tmp_path, environment, monkeypatch):
    """A variable that says where is enough; without it the line says which to set."""

    def nobody(_):
        raise KeyError

    monkeypatch.delenv("HOME")
    monkeypatch.setattr(pwd, "getpwuid", nobody)
    del environment["HF_HUB_CACHE"]
    write(tmp_path / "weights/net")
    assert locate("net", environment=environment) == tmp_path / "weights/net"
    del environment["JAXPHYS_WEIGHTS"]
    refused(r"no home directory; set \$JAXPHYS_WEIGHTS", "net", environment=environment)
    environment["JAXPHYS_WEIGHTS"] = "~/weights"
    refused(r"no home directory", "net", environment=environment)


def test_a_folder_for_weights_that_cannot_be_written(tmp_path, environment):
    del environment["HF_HUB_OFFLINE"]
    (tmp_path / "file").write_text("")
    environment |= {"JAXPHYS_WEIGHTS": str(tmp_path / "file"), "HF_ENDPOINT": "http://127.0.0.1:9"}
    refused("not on this computer", "net", environment=environment)
