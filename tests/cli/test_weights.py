import json
import subprocess
import sys

import pytest
import tyro

from jaxphys.cli import commands
from jaxphys.cli.weights import weights
from jaxphys.core.errors import InputError
from jaxphys.weights import manifest
from jaxphys.weights.catalogue import CATALOGUE, Entry, File
from tests.weights.servers import serving


def run(*arguments):
    """`jaxphys weights ...` as the command line sees it, beside another command."""
    return tyro.extras.subcommand_cli_from_dict(
        {"weights": weights, "materials": commands.materials},
        prog="jaxphys",
        args=["weights", *arguments],
    )


@pytest.fixture
def net(tmp_path, monkeypatch):
    """A network of two files, neither of which is there; the folder that is to hold them."""
    files = (File("a.json", 2), File("b.json", 2))
    made = Entry(
        "net", "for a test", "MIT", files, aliases=("alias",), repositories=("people/net",)
    )
    monkeypatch.setitem(CATALOGUE, "net", made)
    monkeypatch.setenv("JAXPHYS_WEIGHTS", str(tmp_path))
    (tmp_path / "net").mkdir()
    return tmp_path / "net"


def test_list_has_every_network_with_licence_size_and_place(net, capsys):
    (net / "a.json").write_text("{}")
    assert run("list") == 0
    text = capsys.readouterr().out
    for name in (*manifest(), *CATALOGUE):
        assert f"{name}" in text
    assert "net = alias: for a test" in text
    assert f"4 B, MIT; incomplete in {net}: lacks b.json" in text
    assert "161 MB" not in text and "323 MB, MIT; not here; jaxphys weights fetch point-e" in text
    (net / "b.json").write_text("{}")
    run("list")
    assert f"4 B, MIT; in {net}" in capsys.readouterr().out


def test_list_as_json(net, capsys):
    assert run("list", "--json") == 0
    found = {entry["name"]: entry for entry in json.loads(capsys.readouterr().out)}
    assert set(found) == {*manifest(), *CATALOGUE}
    assert found["net"]["missing"] == ["a.json", "b.json"]
    assert found["point_prior"]["missing"] == []
    assert found["smollm2"]["where"] is None


def test_path(net, capsys):
    with pytest.raises(InputError, match=r"missing a\.json"):
        run("path", "net")
    for name in ("a.json", "b.json"):
        (net / name).write_text("{}")
    assert run("path", "alias") == 0
    assert capsys.readouterr().out.strip() == str(net)
    assert run("path", "point_prior") == 0
    assert capsys.readouterr().out.strip().endswith("point_prior.safetensors")


def test_fetch_prints_nothing_but_the_place(net, capfd, monkeypatch):
    monkeypatch.delenv("HF_HUB_OFFLINE")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    with serving(lambda path: (200, {}, b"{}")) as (address, _):
        files = tuple(File(name, 2, url=f"{address}/{name}") for name in ("a.json", "b.json"))
        monkeypatch.setitem(CATALOGUE, "net", Entry("net", "", "MIT", files))
        assert run("fetch", "net") == 0
    assert capfd.readouterr().out.strip() == str(net)
    assert {path.name for path in net.iterdir()} == {"a.json", "b.json"}


def test_fetch_without_a_network_is_one_line(net):
    with pytest.raises(InputError, match="HF_HUB_OFFLINE") as error:
        run("fetch", "stable-diffusion")
    assert "\n" not in str(error.value)


def test_verify_tells_of_each_file_and_sets_the_status(net, capsys):
    (net / "a.json").write_text("{}")
    assert run("verify", "net") == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines == [f"{net}:", "  a.json (2 B): ok, SHA-256 not known", "  b.json: missing"]
    (net / "b.json").write_text("{}")
    assert run("verify", "net") == 0
    assert run("verify", "point_prior") == 0
    assert "matches" in capsys.readouterr().out


def test_an_unknown_name_is_answered_with_the_nearest():
    for command in ("path", "fetch", "verify"):
        with pytest.raises(InputError, match="did you mean 'point-e'"):
            run(command, "point-f")
        with pytest.raises(InputError, match="did you mean 'point_prior'"):
            run(command, "point_priors")


@pytest.mark.parametrize("arguments", [[], ["list", "net"], ["fetch"], ["remove", "net"]])
def test_what_is_no_command_is_refused(arguments, capsys):
    with pytest.raises(SystemExit) as end:
        run(*arguments)
    assert end.value.code == 2


def test_help_and_list_load_nothing_heavy():
    program = (
        "import sys, tyro\n"
        "from jaxphys.cli.weights import weights\n"
        "assert 'numpy' not in sys.modules\n"
        "tyro.extras.subcommand_cli_from_dict({'weights': weights, 'x': weights},"
        " args=['weights', 'list'])\n"
        "assert not {'jax', 'flax', 'huggingface_hub', 'scipy'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL)
