import struct

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians import Gaussians, opacities, read_ply, write_ply, write_splat


def golden(count, rest, endian="<"):
    """A file built field by field: value of field f of Gaussian g is 100 g + f."""
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    names += [f"f_rest_{i}" for i in range(rest)]
    names += ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    style = {"<": "binary_little_endian", ">": "binary_big_endian"}[endian]
    text = f"ply\nformat {style} 1.0\nelement vertex {count}\n"
    text += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    data = text.encode()
    for g in range(count):
        for f, name in enumerate(names):
            data += struct.pack(endian + "f", 0.0 if name in ("nx", "ny", "nz") else 100 * g + f)
    return data, names


def table(count, names):
    return {name: 100.0 * np.arange(count) + f for f, name in enumerate(names)}


@pytest.mark.parametrize("degree,rest", [(0, 0), (1, 9), (2, 24), (3, 45)])
def test_golden_bytes_both_ways(tmp_path, degree, rest):
    data, names = golden(3, rest)
    path = tmp_path / "in.ply"
    path.write_bytes(data)
    g = read_ply(path)
    t = table(3, names)
    assert g.degree == degree and g.count == 3
    assert all(leaf.dtype == jnp.float32 for leaf in jax.tree.leaves(g))
    np.testing.assert_array_equal(g.means, np.stack([t["x"], t["y"], t["z"]], -1))
    np.testing.assert_array_equal(g.log_scales[:, 2], t["scale_2"])
    np.testing.assert_array_equal(g.quaternions[:, 0], t["rot_0"])
    np.testing.assert_array_equal(g.opacity_logits, t["opacity"])
    np.testing.assert_array_equal(g.harmonics[:, 0, 1], t["f_dc_1"])
    per_channel = rest // 3
    for channel in range(3):
        for k in range(per_channel):
            expected = t[f"f_rest_{channel * per_channel + k}"]
            np.testing.assert_array_equal(g.harmonics[:, 1 + k, channel], expected)
    write_ply(tmp_path / "out.ply", g)
    assert (tmp_path / "out.ply").read_bytes() == data
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in.ply", "out.ply"]


def test_big_endian_and_ascii_are_the_same(tmp_path):
    little, names = golden(4, 9)
    big, _ = golden(4, 9, ">")
    lines = [
        "ply",
        "format ascii 1.0",
        "comment by hand",
        "element camera 2",
        "property list uchar int ignored",
        "element vertex 4",
    ]
    (tmp_path / "l.ply").write_bytes(little)
    (tmp_path / "b.ply").write_bytes(big)
    reference = read_ply(tmp_path / "l.ply", dtype=jnp.float64)
    # Fields in reverse order, of mixed types, with one that is not ours, after another element.
    t = table(4, names)
    kept = [name for name in reversed(names) if name not in ("nx", "ny", "nz")]
    lines[4] = "property uchar ignored"
    lines += [f"property {'double' if i % 2 else 'float'} {name}" for i, name in enumerate(kept)]
    lines += ["property int label", "element face 1", "property list uchar int vertex_indices"]
    lines += ["end_header", "7", "8"]
    lines += [" ".join(str(t[name][g]) for name in kept) + " 5" for g in range(4)] + ["3 0 1 2"]
    (tmp_path / "a.ply").write_text("\n".join(lines) + "\n")
    for name in ("b.ply", "a.ply"):
        other = read_ply(tmp_path / name, dtype=jnp.float64)
        for a, b in zip(jax.tree.leaves(reference), jax.tree.leaves(other), strict=True):
            np.testing.assert_array_equal(a, b)


def gaussians(count, seed=0):
    r = np.random.default_rng(seed)
    return Gaussians(
        *(
            jnp.asarray(r.normal(size=shape), jnp.float32)
            for shape in [(count, 3), (count, 3), (count, 4), (count,), (count, 16, 3)]
        )
    )


@pytest.mark.parametrize("count", [0, 1, 50])
def test_round_trip_keeps_every_bit(tmp_path, count):
    g = gaussians(count)
    write_ply(tmp_path / "a.ply", g)
    back = read_ply(tmp_path / "a.ply")
    for a, b in zip(jax.tree.leaves(g), jax.tree.leaves(back), strict=True):
        np.testing.assert_array_equal(a, b)
    write_ply(tmp_path / "b.ply", back)
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def refuse(tmp_path, data, match, **options):
    path = tmp_path / "bad.ply"
    path.write_bytes(data)
    with pytest.raises(InputError, match=match) as caught:
        read_ply(path, **options)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_damaged_files_are_refused(tmp_path):
    data, _ = golden(3, 9)
    refuse(tmp_path, b"", "not a .ply")
    refuse(tmp_path, b"glTF\x02\x00", "not a .ply")
    refuse(tmp_path, data[:60], "no end")
    refuse(tmp_path, b"ply\n" + b"x" * 10_000, "no end")
    refuse(tmp_path, data[:-1], "cut off: the header promises 3")
    refuse(tmp_path, data + b"\n", "1 bytes more")
    refuse(tmp_path, data.replace(b"vertex 3", b"vertex 999999999999"), "limit of 20000000")
    refuse(tmp_path, data.replace(b"vertex 3", b"vertex 19999999"), "cut off")
    refuse(tmp_path, data.replace(b"vertex 3", b"vertex -3"), "'element vertex -3' is not known")
    refuse(tmp_path, data.replace(b"format binary_little_endian 1.0\n", b""), "'format'")
    refuse(tmp_path, data.replace(b"binary_little_endian", b"binary_middle"), "binary_middle")
    refuse(tmp_path, data.replace(b"element vertex", b"element points"), "no 'vertex'")
    refuse(tmp_path, data.replace(b"float x\n", b"list uchar float x\n"), "list properties")
    refuse(tmp_path, data.replace(b"float y\n", b"float x\n"), "'x' stands twice")
    refuse(tmp_path, data, "limit of 2", limit=2)
    refuse(tmp_path, b"ply\nformat ascii 1.0\nelement vertex 3\nend_header\n", "no fields")
    escapes = data.replace(b"float y\n", b"flo\x1b[31m y\n")
    refuse(tmp_path, escapes, r"header line 'property flo\\x1b\[31m y' is not known")
    refuse(tmp_path, data[:-4] + struct.pack("<f", 1e30), "'rot_3' is not finite, or beyond 1e")
    with pytest.raises(InputError, match=r"missing.ply: no such file"):
        read_ply(tmp_path / "missing.ply")
    with pytest.raises(InputError, match="is a folder"):
        read_ply(tmp_path)


def test_foreign_fields_are_refused(tmp_path):
    data, _ = golden(3, 9)
    refuse(tmp_path, data.replace(b"float rot_3", b"float other"), "no field 'rot_3'")
    refuse(tmp_path, data.replace(b"float f_dc_0", b"float red"), "point cloud")
    refuse(tmp_path, data.replace(b"float f_rest_8\n", b"float extra\n"), "8 fields f_rest")
    refuse(tmp_path, data.replace(b"f_rest_8\n", b"f_rest_9\n"), "no field 'f_rest_8'")
    refuse(tmp_path, golden(1, 72)[0], "72 fields f_rest_.*degree 3 or less")
    packed = data.replace(b"float nx", b"float packed_position")
    refuse(tmp_path, packed, "compressed")
    text = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n"
    refuse(tmp_path, text + b"1 2\n", "does not hold 1 numbers")
    refuse(tmp_path, text + b"one\n", "no number")
    refuse(tmp_path, text, "cut off")


def test_values_that_are_not_finite(tmp_path):
    data, names = golden(3, 0)
    body = len(data) - 3 * 4 * len(names)

    def put(gaussian, name, value):
        at = body + 4 * (gaussian * len(names) + names.index(name))
        return data[:at] + struct.pack("<f", value) + data[at + 4 :]

    refuse(tmp_path, put(1, "scale_1", np.nan), r"'scale_1' .* 1 of 3 .*first: 1.*drop_invalid")
    refuse(tmp_path, put(2, "x", np.inf), "'x' is not finite")
    refuse(tmp_path, put(0, "scale_0", np.inf), "'scale_0'")
    path = tmp_path / "bad.ply"
    path.write_bytes(put(1, "scale_1", np.nan))
    kept = read_ply(path, drop_invalid=True)
    np.testing.assert_array_equal(kept.means[:, 0], [0, 200])
    # Opacity exactly 1, and a Gaussian without thickness, have infinite logarithms.
    path.write_bytes(put(1, "opacity", np.inf))
    np.testing.assert_allclose(opacities(read_ply(path))[1], 1, atol=1e-6)
    path.write_bytes(put(1, "scale_2", -np.inf))
    assert jnp.isfinite(read_ply(path).log_scales).all()


def test_writing_refuses_what_cannot_be_read_back(tmp_path):
    g = gaussians(4)
    path = tmp_path / "old.ply"
    write_ply(path, g)
    before = path.read_bytes()
    nan = jax.tree.map(lambda leaf: leaf.at[2].set(jnp.nan), g)
    with pytest.raises(InputError, match=r"old.ply: means not finite"):
        write_ply(path, nan)
    large = jax.tree.map(lambda leaf: leaf.astype(jnp.float64) * 1e60, g)
    with pytest.raises(InputError, match="beyond float32"):
        write_ply(path, large)
    with pytest.raises(InputError, match="beyond float32"):
        write_splat(path, large)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["old.ply"]


def test_splat_golden_bytes(tmp_path):
    dc = (np.array([[0.0, 0.5, 1.0], [2.0, -1.0, 0.2]]) - 0.5) * np.sqrt(4 * np.pi)
    g = Gaussians(
        jnp.array([[1.0, 2, 3], [4, 5, 6]]),
        jnp.log(jnp.array([[0.5, 0.25, 0.125], [1, 1, 1]])),
        jnp.array([[2.0, 0, 0, 0], [0, 0, -3, 0]]),
        jnp.array([0.0, jnp.log(3.0)]),
        jnp.concatenate([jnp.asarray(dc)[:, None], jnp.ones((2, 3, 3))], axis=1),
    )
    write_splat(tmp_path / "a.splat", g)
    small = struct.pack("<6f8B", 1, 2, 3, 0.5, 0.25, 0.125, 0, 128, 255, 128, 255, 128, 128, 128)
    large = struct.pack("<6f8B", 4, 5, 6, 1, 1, 1, 255, 0, 51, 191, 128, 128, 0, 128)
    assert (tmp_path / "a.splat").read_bytes() == large + small  # the more important one first
