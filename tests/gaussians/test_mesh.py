import dataclasses
import json
import struct
import tracemalloc

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial import cKDTree
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from jaxphys.core.errors import InputError
from jaxphys.core.rotations import quaternion_to_matrix
from jaxphys.gaussians import gaussians_from_mesh, load_mesh, sample_surface, scales
from jaxphys.gaussians.harmonics import dc_to_rgb
from jaxphys.gaussians.mesh import Mesh


def plain(shape, colour=(1, 1, 1, 1)):
    triangles = np.asarray(shape.triangles)
    count = len(triangles)
    return Mesh(
        triangles,
        np.broadcast_to(np.asarray(colour, float), (count, 3, 4)),
        np.zeros((count, 3, 2)),
        (),
        np.full(count, -1),
        np.full(count, -1.0),
    )


SHAPES = {
    "sphere": trimesh.creation.icosphere(subdivisions=3),
    "plate": trimesh.creation.box(extents=[3, 1, 0.01]),
    "torus": trimesh.creation.torus(1.0, 0.3),
}


def coverage(g, points, normals):
    """Alpha along the normal through `points`, of the discs that face the same way."""
    axis = np.asarray(quaternion_to_matrix(g.quaternions))
    offset = points[:, None] - np.asarray(g.means)
    local = np.einsum("gij,pgi->pgj", axis, offset)
    across = np.sum((local / np.asarray(scales(g)))[..., :2] ** 2, axis=-1)
    facing = np.abs(np.einsum("pi,gi->pg", normals, axis[:, :, 2])) > 0.8
    near = facing & (np.abs(local[..., 2]) < 0.1)
    return 1 - np.prod(1 - np.where(near, 0.95 * np.exp(-0.5 * across), 0), axis=1)


@pytest.mark.parametrize("name", SHAPES)
def test_no_holes(name):
    mesh, count = plain(SHAPES[name]), 2000
    g = gaussians_from_mesh(mesh, count, seed=1, dtype=jnp.float64)
    assert g.count == count
    shape = SHAPES[name]
    points, faces = trimesh.sample.sample_surface(shape, 600, seed=3)
    probes = shape.face_normals[faces]
    broad = (np.abs(probes[:, 2]) > 0.5) | (name != "plate")  # not the plate's narrow rim
    covered = coverage(g, points[broad], probes[broad])
    assert covered.min() > 0.88 and np.median(covered) > 0.97
    half = dataclasses.replace(g, log_scales=g.log_scales - np.log(2))
    assert coverage(half, points[broad], probes[broad]).min() < 0.4
    assert np.asarray(scales(g))[:, :2].max() < 0.1 * np.ptp(shape.vertices)


def test_samples_are_even_and_on_the_surface():
    mesh = plain(SHAPES["torus"])
    samples = sample_surface(mesh, 1500, seed=0)
    ring = np.hypot(samples.points[:, 0], samples.points[:, 1]) - 1
    assert np.abs(np.hypot(ring, samples.points[:, 2]) - 0.3).max() < 0.02
    outward = np.stack(
        [ring * samples.points[:, 0], ring * samples.points[:, 1], samples.points[:, 2]], -1
    )
    assert np.einsum("ni,ni->n", outward, samples.normals).min() > 0
    nearest = cKDTree(samples.points).query(samples.points, k=2)[0][:, 1]
    random = trimesh.sample.sample_surface(SHAPES["torus"], 1500, seed=0)[0]
    random_nearest = cKDTree(random).query(random, k=2)[0][:, 1]
    assert nearest.std() / nearest.mean() < 0.2 < random_nearest.std() / random_nearest.mean()
    spacing = np.sqrt(SHAPES["torus"].area / 1500)
    np.testing.assert_allclose(np.median(samples.spacing), spacing, rtol=0.1)
    # By area, not by triangle: the outer half of a torus has (pi r + 2 R) / (2 pi R) of it.
    outer = np.mean(ring > 0)
    np.testing.assert_allclose(outer, 0.5 + 0.3 / np.pi, atol=0.02)


def test_discs_lie_in_the_surface():
    g = gaussians_from_mesh(plain(SHAPES["sphere"]), 300, thickness=0.2, dtype=jnp.float64)
    axis = quaternion_to_matrix(g.quaternions)[:, :, 2]
    along = jnp.abs(jnp.sum(axis * g.means, axis=1)) / jnp.linalg.norm(g.means, axis=1)
    assert along.min() > 0.99
    np.testing.assert_allclose(scales(g)[:, 2], 0.2 * scales(g)[:, 0], rtol=1e-12)


def test_seed_decides_the_bytes():
    mesh = plain(SHAPES["sphere"])
    a, b, c = (gaussians_from_mesh(mesh, 100, seed) for seed in (5, 5, 6))
    for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True):
        np.testing.assert_array_equal(x, y)
    assert jnp.abs(a.means - c.means).max() > 0.1
    assert a.means.dtype == jnp.float32
    assert gaussians_from_mesh(mesh, 1).count == 1


OBJ = """mtllib parts.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl red\nf 1 2 3\nf 1 3 4
usemtl picture\nf 5/1 6/2 7/3\nf 5/1 7/3 8/4
"""


def write_obj(folder):
    (folder / "box.obj").write_text(OBJ)
    (folder / "parts.mtl").write_text(
        "newmtl red\nKd 1 0 0\nnewmtl picture\nKd 1 1 1\nmap_Kd picture.png\n"
    )
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:4, :4], pixels[:4, 4:] = [0, 255, 0], [0, 0, 255]  # top row: green, blue
    pixels[4:, :4], pixels[4:, 4:] = [255, 255, 0], [255, 255, 255]
    Image.fromarray(pixels).save(folder / "picture.png")


def test_obj_with_several_materials_and_a_texture(tmp_path):
    write_obj(tmp_path)
    mesh = load_mesh(tmp_path / "box.obj", up="z")
    g = gaussians_from_mesh(mesh, 800, dtype=jnp.float64)
    rgb, (x, y, z) = np.asarray(dc_to_rgb(g.harmonics[:, 0])), np.asarray(g.means).T
    np.testing.assert_allclose(
        rgb[z < 0.5], np.broadcast_to([1, 0, 0], rgb[z < 0.5].shape), atol=1e-9
    )
    for inside, expected in [
        ((x < 0.4) & (y > 0.6), [0, 1, 0]),
        ((x > 0.6) & (y > 0.6), [0, 0, 1]),
        ((x < 0.4) & (y < 0.4), [1, 1, 0]),
        ((x > 0.6) & (y < 0.4), [1, 1, 1]),
    ]:
        # away from the border of the repeating picture, where its other side is blended in
        inside = inside & (z > 0.5) & (np.abs([x, y] - np.array([[0.5]])).max(axis=0) < 0.4)
        assert inside.sum() > 10
        np.testing.assert_allclose(
            rgb[inside], np.broadcast_to(expected, rgb[inside].shape), atol=1e-9
        )
    turned = load_mesh(tmp_path / "box.obj")  # y up
    assert turned.triangles[..., 1].max() <= 0 and turned.triangles[..., 1].min() == -1


def test_missing_companions_are_named(tmp_path):
    write_obj(tmp_path)
    (tmp_path / "picture.png").unlink()
    with pytest.raises(InputError, match=r"parts.mtl: its texture .*picture.png is missing"):
        load_mesh(tmp_path / "box.obj")
    (tmp_path / "parts.mtl").unlink()
    with pytest.raises(InputError, match=r"box.obj: its materials .*parts.mtl are missing"):
        load_mesh(tmp_path / "box.obj")


def test_glb_transform_texture_factor_and_vertex_colours(tmp_path):
    box = trimesh.creation.box()
    image = Image.fromarray(np.full((4, 4, 3), 128, np.uint8))
    material = PBRMaterial(baseColorTexture=image, baseColorFactor=[255, 55, 0, 255])
    box.visual = TextureVisuals(uv=np.full((8, 2), 0.5), material=material)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.5)
    ball.visual.vertex_colors = np.tile([0, 55, 255, 255], (len(ball.vertices), 1))
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([0, 3, 0]))
    scene.add_geometry(ball)
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    g = gaussians_from_mesh(load_mesh(tmp_path / "a.glb"), 500, dtype=jnp.float64)
    rgb, z = np.asarray(dc_to_rgb(g.harmonics[:, 0])), np.asarray(g.means)[:, 2]
    assert z.max() > 3.4  # up in the file, up in the world
    # 55/255 of linear light is 0.5 as a display value (sRGB).
    np.testing.assert_allclose(
        rgb[z > 2], np.broadcast_to([0.502, 0.252, 0], rgb[z > 2].shape), atol=0.003
    )
    np.testing.assert_allclose(
        rgb[z < 2], np.broadcast_to([0, 0.502, 1], rgb[z < 2].shape), atol=0.003
    )


def test_alpha_cuts_out():
    shape = trimesh.creation.box()
    mesh = plain(shape)
    image = np.ones((16, 16, 4))
    image[:, 8:, 3] = 0  # right half not there
    gone = shape.face_normals[0]
    uvs = np.where((shape.face_normals @ gone > 0.5)[:, None, None], 0.75, 0.25)
    uvs = np.broadcast_to(uvs, (len(shape.triangles), 3, 2))
    cut = Mesh(
        mesh.triangles, mesh.colours, uvs, (image,), np.zeros_like(mesh.texture), mesh.cutoff + 1.5
    )
    samples = sample_surface(cut, 400)
    assert len(samples.points) == 400
    assert np.einsum("ni,i->n", samples.normals, gone).max() < 0.5
    opaque = Mesh(cut.triangles, cut.colours, uvs, (image,), cut.texture, mesh.cutoff)
    assert np.einsum("ni,i->n", sample_surface(opaque, 400).normals, gone).max() > 0.5
    nothing = Mesh(cut.triangles, cut.colours, uvs, (image * 0,), cut.texture, cut.cutoff)
    with pytest.raises(InputError, match="cuts the whole surface out"):
        sample_surface(nothing, 10)


def test_fine_textures_are_averaged():
    shape = trimesh.creation.box()
    mesh = plain(shape)
    fine = np.ones((256, 256, 4))
    fine[::2, ::2, :3] = fine[1::2, 1::2, :3] = 0  # black and white texels, far below the spacing
    uvs = np.broadcast_to(np.array([[0, 0], [1, 0], [1, 1]]), (len(shape.triangles), 3, 2))
    board = Mesh(mesh.triangles, mesh.colours, uvs, (fine,), mesh.texture + 1, mesh.cutoff)
    colours = sample_surface(board, 200).colours
    np.testing.assert_allclose(colours, 0.5, atol=0.05)


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".off"])
def test_other_formats(tmp_path, suffix):
    trimesh.creation.box(extents=[1, 2, 3]).export(tmp_path / f"a{suffix}")
    mesh = load_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_allclose(np.ptp(mesh.triangles.reshape(-1, 3), axis=0), [1, 2, 3])
    np.testing.assert_allclose(mesh.areas().sum(), 22, rtol=1e-6)


def test_unusable_files_are_refused(tmp_path):
    def refuse(name, text, match):
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=match) as caught:
            load_mesh(tmp_path / name)
        assert name in str(caught.value)

    refuse("empty.obj", "", "empty.obj")
    refuse("noise.glb", "not a mesh", "cannot be read as a mesh")
    refuse("kind.xyzzy", "what", "cannot be read as a mesh")
    off = "OFF\n3 1 0\n0 0 0\n1 0 0\n{} 1 0\n3 0 1 2\n"
    refuse("nan.off", off.format("nan"), "not finite")
    refuse("flat.off", off.format("0"), "flat, no extent along z")
    points = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    refuse("cloud.ply", points + "property float z\nend_header\n1 2 3\n", "no triangles")
    line = "OFF\n4 2 0\n0 0 0\n1 1 1\n2 2 2\n3 3 3\n3 0 1 2\n3 1 2 3\n"
    refuse("line.off", line, "zero area")
    with pytest.raises(InputError, match="no such file"):
        load_mesh(tmp_path / "none.obj")
    with pytest.raises(InputError, match="give 'y' or 'z'"):
        load_mesh(tmp_path / "line.off", up="x")
    with pytest.raises(InputError, match="at least 1"):
        sample_surface(plain(SHAPES["sphere"]), 0)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("mtllib parts.mtl", "mtllib", "box.obj: a line mtllib names no file"),
        ("v 1 1 0", "v 1 1", "box.obj: "),
        ("v 1 1 0", "v 1e155 1e155 0", "beyond 1e"),
        ("v 1 1 0", "v nan 1 0", "not finite"),
    ],
)
def test_lines_that_say_nothing_usable(tmp_path, old, new, match):
    write_obj(tmp_path)
    (tmp_path / "box.obj").write_text(OBJ.replace(old, new))
    with pytest.raises(InputError, match=match):
        load_mesh(tmp_path / "box.obj")


def test_a_texture_without_a_name(tmp_path):
    write_obj(tmp_path)
    path = tmp_path / "parts.mtl"
    path.write_text(path.read_text().replace("map_Kd picture.png", "map_Kd "))
    with pytest.raises(InputError, match=r"parts.mtl: a line map_Kd names no file"):
        load_mesh(tmp_path / "box.obj")


def test_corners_all_of_two_numbers(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"a.obj: "):
        load_mesh(tmp_path / "a.obj")


@pytest.mark.filterwarnings("ignore:Image size")
def test_small_pictures_that_unpack_to_gigabytes_are_refused_unread(tmp_path):
    write_obj(tmp_path)
    Image.new("1", (13_000, 13_000)).save(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size < 100_000
    tracemalloc.start()
    with pytest.raises(InputError, match="its textures have 169 million pixels"):
        load_mesh(tmp_path / "box.obj")
    box = trimesh.creation.box()
    with Image.open(tmp_path / "picture.png") as image:
        box.visual = TextureVisuals(
            uv=np.full((8, 2), 0.5), material=PBRMaterial(baseColorTexture=image)
        )
        (tmp_path / "a.glb").write_bytes(trimesh.Scene(box).export(file_type="glb"))
    tracemalloc.reset_peak()
    with pytest.raises(InputError, match=r"a.glb: its textures have 169 million pixels"):
        load_mesh(tmp_path / "a.glb")
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()


def test_meshes_too_small_for_numbers(tmp_path):
    trimesh.creation.box().apply_scale(1e-20).export(tmp_path / "a.stl", file_type="stl_ascii")
    with pytest.raises(InputError, match=r"a.stl: "):
        load_mesh(tmp_path / "a.stl")


def test_corners_that_are_promised_and_not_there(tmp_path):
    path = tmp_path / "a.glb"
    data = trimesh.Scene(trimesh.creation.box()).export(file_type="glb")
    (length,) = struct.unpack_from("<I", data, 12)
    tree = json.loads(data[20 : 20 + length])
    for accessor in tree["accessors"]:
        del accessor["bufferView"]
        accessor["count"] = 2**31
    text = json.dumps(tree).encode()
    rest = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + length :]
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(rest)) + rest)
    with pytest.raises(InputError, match=r"a.glb: promises .* corners"):
        load_mesh(path)
