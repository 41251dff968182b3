"""Compressed .ply: the bytes that the format asks for, and what its bits can lose."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.export import compressed_ply_writer, read_compressed_ply, write_compressed_ply
from jaxphys.export.compressed_ply import spatial_order
from jaxphys.gaussians import select
from jaxphys.scene.source import load
from tests.export.cases import angles, cloud, opacity

C0 = 0.28209479177387814
# Each of three components is off by half a step of sqrt(2) / 1023 and the fourth, of 1/2 at least,
# by sqrt(3) times what these are together; a turn is twice the angle between quaternions.
TURN = np.degrees(2 * 2 * np.sqrt(3) * np.sqrt(2) / 2046)


def parsed(path):
    """The header's lines, and the rest as chunks float32 (C, 18), words (N, 4), bytes (N, R)."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    chunk, count = counts["chunk"], counts["vertex"]
    ranges = np.frombuffer(data, "<f4", 18 * chunk).reshape(chunk, 18)
    words = np.frombuffer(data, "<u4", 4 * count, 72 * chunk).reshape(count, 4)
    rest = np.frombuffer(data, "u1", offset=72 * chunk + 16 * count)
    return lines, ranges, words, rest.reshape(count, -1)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_round_trip_loses_what_the_bits_lose(tmp_path, degree):
    path = tmp_path / "a.compressed.ply"
    given = cloud(degree=degree)
    order = spatial_order(np.asarray(given.means))
    assert sorted(order) == list(range(given.count))
    write_compressed_ply(path, given)
    sent, got = select(given, order), read_compressed_ply(path)
    assert got.degree == degree and all(x.dtype == jnp.float32 for x in jax.tree.leaves(got))
    chunk = np.arange(given.count) // 256

    def extent(values):
        values = np.asarray(values, float)
        return np.array([np.ptp(values[chunk == c], axis=0) for c in range(3)])[chunk]

    half_steps = np.array([0.5 / 2047, 0.5 / 1023, 0.5 / 2047])
    close = 1 + 1e-4  # for float32 in the file
    off = np.abs(np.asarray(got.means - sent.means))
    assert np.all(off <= close * half_steps * extent(sent.means) + 1e-6)
    off = np.abs(np.asarray(got.log_scales - sent.log_scales))
    assert np.all(off <= close * half_steps * extent(sent.log_scales) + 1e-6)
    off = np.abs(np.asarray(got.harmonics[:, 0] - sent.harmonics[:, 0]))
    assert np.all(off <= close * extent(sent.harmonics[:, 0]) / 510 + 1e-6)
    assert np.all(np.abs(opacity(got) - opacity(sent)) <= close / 510)
    assert np.all(np.abs(got.harmonics[:, 1:] - sent.harmonics[:, 1:]) <= close / 64)
    assert angles(got.quaternions, np.asarray(sent.quaternions)).max() <= TURN < 0.3
    # And it is no larger than that: less would mean that the test looks at something else.
    assert np.abs(got.means - sent.means).max() > 1e-4


def test_the_bytes_are_those_of_the_format(tmp_path):
    path = tmp_path / "a.compressed.ply"
    given = cloud(300, degree=1)
    write_compressed_ply(path, given, order=np.arange(300))
    lines, ranges, words, rest = parsed(path)
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    assert lines[:3] == ["ply", "format binary_little_endian 1.0", "element chunk 2"]
    assert names[:4] == ["min_x", "min_y", "min_z", "max_x"]
    assert names[6] == "min_scale_x" and names[12] == "min_r" and names[17] == "max_b"
    assert lines[21:27] == ["element vertex 300", "property uint packed_position",
                            "property uint packed_rotation", "property uint packed_scale",
                            "property uint packed_color", "element sh 300"]  # fmt: skip
    assert lines[27:] == [f"property uchar f_rest_{i}" for i in range(9)]
    means, logs = np.asarray(given.means), np.asarray(given.log_scales)
    for chunk, part in enumerate((slice(0, 256), slice(256, 300))):
        np.testing.assert_array_equal(ranges[chunk, :3], means[part].min(axis=0))
        np.testing.assert_array_equal(ranges[chunk, 3:6], means[part].max(axis=0))
        np.testing.assert_array_equal(ranges[chunk, 6:9], logs[part].min(axis=0))
        rgb = np.asarray(given.harmonics[part, 0], float) * C0 + 0.5
        np.testing.assert_allclose(ranges[chunk, 15:], rgb.max(axis=0), rtol=1e-6)
    # One Gaussian by hand: x and z have eleven bits and y ten, x on top.
    low, high = ranges[0, :3].astype(float), ranges[0, 3:6].astype(float)
    x, y, z = np.floor((means[7] - low) / (high - low) * [2047, 1023, 2047] + 0.5).astype(int)
    assert words[7, 0] == x << 21 | y << 11 | z
    q = np.asarray(given.quaternions[7], float)
    q /= np.linalg.norm(q)
    top = int(np.argmax(np.abs(q)))
    q *= np.sign(q[top])
    word = top
    for value in np.delete(q, top):
        word = word << 10 | int(np.floor((value / np.sqrt(2) + 0.5) * 1023 + 0.5))
    assert words[7, 1] == word
    assert words[7, 3] & 255 == round(255 * opacity(given)[7])
    # All coefficients of red, then of green, then of blue.
    green = float(given.harmonics[7, 2, 1])
    assert rest[7, 3 + 1] == int((green / 8 + 0.5) * 256)


def test_neighbours_share_chunks(tmp_path):
    """So that a chunk's range is much smaller than the whole, and places in it finer."""
    path = tmp_path / "a.compressed.ply"
    given = cloud(64 * 256, degree=0)
    box = np.random.default_rng(0).random(given.means.shape).astype(np.float32)
    given = replace(given, means=jnp.asarray(box))
    extents = []
    for order in (None, np.arange(given.count)):
        write_compressed_ply(path, given, order=order)
        ranges = parsed(path)[1]
        extents.append(np.median(ranges[:, 3:6] - ranges[:, :3]))
    assert extents[0] < 0.4 * extents[1]  # a quarter, were they cubes


def test_the_frames_of_a_motion_keep_one_order(tmp_path):
    first, write = cloud(300, degree=0), compressed_ply_writer()
    turned = cloud(300, degree=0, seed=1)
    write(tmp_path / "0.ply", first)
    write(tmp_path / "1.ply", turned)
    order = spatial_order(np.asarray(first.means))
    got = read_compressed_ply(tmp_path / "1.ply")
    np.testing.assert_allclose(got.means, turned.means[order], atol=0.01)
    assert not np.array_equal(order, spatial_order(np.asarray(turned.means)))


def test_one_gaussian_and_equal_ones(tmp_path):
    """A range without extent."""
    one = select(cloud(1), np.zeros(3, int))
    write_compressed_ply(tmp_path / "a.ply", one)
    got = read_compressed_ply(tmp_path / "a.ply")
    np.testing.assert_allclose(got.means, one.means, rtol=1e-6)
    np.testing.assert_allclose(got.log_scales, one.log_scales, rtol=1e-6)


def test_load_reads_it_without_being_told(tmp_path):
    write_compressed_ply(tmp_path / "a.ply", cloud(20))
    assert load(tmp_path / "a.ply").count == 20


def test_bad_files_are_one_line(tmp_path):
    path = tmp_path / "a.ply"
    write_compressed_ply(path, cloud(300, degree=1))
    good = path.read_bytes()
    nan = good.replace(b"end_header\n", b"end_header\n" + np.float32(np.nan).tobytes(), 1)
    bad = {
        "cut off": good[:-1],
        "longer": good + b"x",
        "element 'chunk'": good.replace(b"float min_x", b"float mix_x"),
        "element 'vertex'": good.replace(b"uint packed_scale", b"int packed_scale"),
        "chunks of 256": good.replace(b"chunk 2", b"chunk 3"),
        "of elements chunk, vertex and sh": good.replace(
            b"element vertex", b"element vertex 1\nelement vertex"
        ),
        "binary_little": good.replace(b"binary_little_endian", b"binary_big_endian"),
        "'min_x' is not finite": nan[: nan.index(b"end_header\n") + 15]
        + good[good.index(b"end_header\n") + 15 :],
    }
    for words, data in bad.items():
        path.write_bytes(data)
        with pytest.raises(InputError, match=words) as refused:
            read_compressed_ply(path)
        assert str(path) in str(refused.value)


@pytest.mark.parametrize("field", ["means", "log_scales", "opacity_logits"])
def test_what_is_not_finite_is_not_written(tmp_path, field):
    given = cloud(5)
    bad = replace(given, **{field: getattr(given, field).at[2].set(jnp.nan)})
    with pytest.raises(InputError, match=field):
        write_compressed_ply(tmp_path / "a.ply", bad)
    assert not list(tmp_path.iterdir())
