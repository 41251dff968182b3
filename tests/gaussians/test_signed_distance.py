"""The signed distance of a mesh: against a brute force, and what is not closed is refused."""

import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.gaussians.mesh import load_mesh, write_triangles
from jaxphys.gaussians.signed_distance import signed_distance, to_triangles

trimesh = pytest.importorskip("trimesh")


def grid(found):
    axes = [found.first[a] + found.pitch * np.arange(n) for a, n in enumerate(found.distance.shape)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1)


def tetrahedron():
    corners = np.array([[0.0, 0, 0], [1.0, 0.1, 0], [0.2, 0.9, 0.1], [0.3, 0.2, 0.8]])
    return corners[[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]]


def test_distances_of_a_box_are_those_of_its_formula():
    box = np.asarray(trimesh.creation.box((2.0, 1.0, 0.6)).triangles) + np.array([5.0, -3.0, 1.0])
    found = signed_distance(box, 15, 0.2)
    beyond = np.abs(grid(found)) - [0.5, 0.25, 0.15]
    exact = np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(-1), 0)
    np.testing.assert_allclose(found.distance, exact, atol=1e-12)
    assert -np.array(found.first) @ [1, 0, 0] >= 0.7 and found.pitch == 1 / 14


def test_distances_are_those_of_all_triangles_and_signs_those_of_all_solid_angles():
    """Of a figure that is not convex, and of one that is turned inside out."""
    triangles = np.asarray(trimesh.creation.torus(0.4, 0.13, 14, 9).triangles)
    triangles = np.concatenate([triangles, 0.3 * tetrahedron() + [0.3, 0.0, 0.3]])
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    own = (triangles - (low + high) / 2) / np.max(high - low)
    for given in (triangles, triangles[:, ::-1]):
        found = signed_distance(given, 14, 0.05)
        points = grid(found).reshape(-1, 3)
        every = np.min([to_triangles(points, np.broadcast_to(t, (len(points), 3, 3)))
                        for t in own], axis=0)  # fmt: skip
        near = every < 0.15
        flat = found.distance.ravel()
        np.testing.assert_allclose(np.abs(flat)[near], every[near], atol=1e-12)
        assert (np.abs(flat) >= every - 1e-12).all()
        assert np.max(np.abs(flat) - every) < found.pitch
        # The solid angle of a triangle (Van Oosterom and Strackee 1983).
        a, b, c = np.moveaxis(own[:, :, None] - points, 1, 0)
        la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
        triple = np.sum(a * np.cross(b, c), axis=-1)
        rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        winding = np.sum(np.arctan2(triple, rest), axis=0) / (2 * np.pi)
        inside = np.abs(winding) > 0.5
        assert 20 < inside.sum() < 0.5 * inside.size
        np.testing.assert_array_equal(flat < 0, inside)


def test_the_nearest_point_of_a_triangle():
    triangle = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 1.0, 0]])
    points = np.array([[0.2, 0.2, 0.5], [-1.0, -1.0, 0], [0.5, -0.3, 0.4], [2.0, 0, 0], [1, 1, 0]])
    found = to_triangles(points, np.broadcast_to(triangle, (5, 3, 3)))
    np.testing.assert_allclose(found, [0.5, 2**0.5, 0.5, 1.0, 0.5**0.5])
    line = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])  # of no area
    assert to_triangles(np.array([[1.5, 3.0, 4.0]]), line[None]) == pytest.approx(5.0)


def test_what_is_not_closed_is_refused():
    whole = np.asarray(trimesh.creation.box((1.0, 1.0, 1.0)).triangles)
    turned = whole.copy()
    turned[3] = turned[3, ::-1]
    for triangles, count in ((whole[1:], 3), (turned, 3)):
        with pytest.raises(InputError, match=f"not closed: {count} of its edges"):
            signed_distance(triangles, 8, 0.1)
    # A triangle without area between two others closes them.
    signed_distance(np.concatenate([whole, whole[:1, [0, 1, 1]]]), 8, 0.1)


def test_triangles_are_written_to_the_last_digit(tmp_path):
    triangles = np.random.default_rng(0).normal(size=(7, 3, 3))
    write_triangles(tmp_path / "some.ply", triangles)
    np.testing.assert_array_equal(load_mesh(tmp_path / "some.ply").triangles, triangles)
