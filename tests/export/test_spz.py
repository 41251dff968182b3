"""SPZ: the bytes that the format asks for, and what its bits can lose."""

import gzip
import struct
from dataclasses import replace
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.export import read_spz, write_spz
from jaxphys.gaussians import harmonics as sh
from tests.export.cases import UP, angles, cloud, opacity

TURN = np.degrees(2 * 2 * np.sqrt(3) * np.sqrt(0.5) / 1022)  # as for a compressed .ply


def parts(path):
    """The header's numbers and the arrays of bytes, straight from the format's description."""
    data = gzip.decompress(path.read_bytes())
    magic, version, count, degree, places, flags, reserved = struct.unpack("<IIIBBBB", data[:16])
    sizes = [9, 1, 3, 3, 4, 3 * ((degree + 1) ** 2 - 1)]
    ends = 16 + count * np.cumsum([0, *sizes])
    assert ends[-1] == len(data)
    arrays = [np.frombuffer(data[a:b], np.uint8).reshape(count, -1) for a, b in pairwise(ends)]
    return (magic, version, count, degree, places, flags, reserved), arrays


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
@pytest.mark.parametrize("spread", [0.01, 1.0, 300.0])
def test_a_round_trip_loses_what_the_bits_lose(tmp_path, degree, spread):
    path = tmp_path / "a.spz"
    sent = cloud(degree=degree, spread=spread)
    write_spz(path, sent)
    got = read_spz(path)
    assert got.degree == degree and all(x.dtype == jnp.float32 for x in jax.tree.leaves(got))
    places = parts(path)[0][4]
    reach = float(np.abs(sent.means).max())
    # Half a step, and float32 on both sides.
    step = 2.0**-places
    assert step <= max(2.0**-16 * reach, 2.0**-23) and step <= 2.0**-12
    assert np.abs(got.means - sent.means).max() <= step / 2 + 2e-7 * reach
    assert np.abs(got.log_scales - sent.log_scales).max() <= 1 / 32 + 1e-5
    assert np.abs(opacity(got) - opacity(sent)).max() <= 1 / 510 + 1e-6
    dc = np.abs(got.harmonics[:, 0] - sent.harmonics[:, 0]).max()
    assert dc <= 0.5 / (0.15 * 255) + 1e-5
    # The harmonics were turned before and after, which mixes what the bits lose: the error of a
    # degree, as a vector of 2 l + 1 halves of steps, keeps its length.
    for order in range(1, degree + 1):
        part = slice(order**2, (order + 1) ** 2)
        off = np.linalg.norm(np.asarray(got.harmonics - sent.harmonics)[:, part], axis=1)
        assert off.max() <= np.sqrt(2 * order + 1) / 256 + 1e-5
    assert angles(got.quaternions, np.asarray(sent.quaternions)).max() <= TURN + 0.01 < 0.3


def test_the_bytes_are_those_of_the_format(tmp_path):
    path = tmp_path / "a.spz"
    given = cloud(50, degree=1)
    write_spz(path, given)
    header, (centres, alphas, colours, scales, rotations, rest) = parts(path)
    assert header[:4] == (0x5053474E, 3, 50, 1) and header[5:] == (0, 0)
    assert gzip.decompress(path.read_bytes())[:4] == b"NGSP"
    fixed = [int.from_bytes(bytes(centres[7, 3 * i : 3 * i + 3]), "little", signed=True)
             for i in range(3)]  # fmt: skip
    place = UP @ np.asarray(given.means[7], float)  # right, up, back
    np.testing.assert_array_equal(fixed, np.rint(place * 2 ** header[4]))
    assert alphas[7, 0] == round(255 * opacity(given)[7])
    red = float(given.harmonics[7, 0, 0])
    assert colours[7, 0] == round(red * 0.15 * 255 + 127.5)
    assert scales[7, 1] == round((float(given.log_scales[7, 1]) + 10) * 16)
    # Colours inside coefficients; the first of degree 1 is along -y: our z once it is turned.
    turned = sh.rotate(given.harmonics, jnp.asarray(UP, jnp.float32))
    np.testing.assert_allclose(turned[7, 1], -given.harmonics[7, 2], atol=1e-6)
    assert np.abs(rest[7, :3] - (128 - 128 * np.asarray(given.harmonics[7, 2]))).max() <= 0.5001
    word = int.from_bytes(bytes(rotations[7]), "little")
    values = [(-1) ** (word >> s + 9 & 1) * (word >> s & 511) / 511 / 2**0.5 for s in (20, 10, 0)]
    values.insert(word >> 30, np.sqrt(1 - np.square(values).sum()))  # x, y, z, w
    half = 0.5**0.5
    w, x, y, z = np.asarray(given.quaternions[7], float)
    # A quarter turn about -x, times the quaternion.
    sent = half * np.array([w + x, x - w, y + z, z - y])
    assert angles(np.array([[values[3], *values[:3]]]), sent[None])[0] <= TURN


def test_equal_gaussians_give_equal_bytes(tmp_path):
    write_spz(tmp_path / "a.spz", cloud(20))
    write_spz(tmp_path / "b.spz", cloud(20))
    assert (tmp_path / "a.spz").read_bytes() == (tmp_path / "b.spz").read_bytes()


def test_version_2_is_read(tmp_path):
    """Its quaternions are x, y, z as bytes."""
    header = struct.pack("<IIIBBBB", 0x5053474E, 2, 1, 0, 12, 0, 0)
    body = (4096).to_bytes(3, "little") + (-4096 % 2**24).to_bytes(3, "little") + bytes(3)
    body += bytes([128, 128, 128, 128, 160, 160, 160, 255, 128, 128])
    (tmp_path / "a.spz").write_bytes(gzip.compress(header + body))
    got = read_spz(tmp_path / "a.spz")
    np.testing.assert_allclose(got.means, [[1, 0, -1]], atol=1e-6)  # y up: (1, -1, 0)
    np.testing.assert_allclose(got.log_scales, 0, atol=1e-6)


def test_what_lies_too_far_is_refused(tmp_path):
    far = replace(cloud(3), means=cloud(3).means * 1e8)
    with pytest.raises(InputError, match="more than SPZ can hold"):
        write_spz(tmp_path / "a.spz", far)
    assert not list(tmp_path.iterdir())


def test_bad_files_are_one_line(tmp_path):
    path = tmp_path / "a.spz"
    write_spz(path, cloud(10, degree=1))
    raw = gzip.decompress(path.read_bytes())
    good = path.read_bytes()
    bad = {
        "version 4": b"NGSP" + bytes(40),
        "no SPZ file": b"hello",
        "damaged": good[:-9],
        "begin with": gzip.compress(b"NGPS" + raw[4:]),
        "version 7": gzip.compress(raw[:4] + b"\7" + raw[5:]),
        "degree 4": gzip.compress(raw[:12] + b"\4" + raw[13:]),
        "extensions": gzip.compress(raw[:14] + b"\2" + raw[15:]),
        "binary places": gzip.compress(raw[:13] + b"\x40" + raw[14:]),
        "cut off": gzip.compress(raw[:-1]),
        "longer": gzip.compress(raw + b"x"),
        "holds 0": gzip.compress(raw[:8] + bytes(4) + raw[12:]),
        "promises 16777226": gzip.compress(raw[:11] + b"\1" + raw[12:]),
    }
    for words, data in bad.items():
        path.write_bytes(data)
        with pytest.raises(InputError, match=words) as refused:
            read_spz(path)
        assert str(path) in str(refused.value)
