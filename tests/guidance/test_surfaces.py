import numpy as np

from jaxphys.guidance.surfaces import (
    local_pieces,
    medoid_colours,
    surface_of_cloud,
    towards_surface,
)


def noisy_sphere(count=1500, noise=0.01):
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = 0.4 * normals + noise * rng.normal(size=(count, 3))
    colours = np.where(normals[:, 2:] > 0, [1.0, 0, 0], [0.0, 0, 1])
    return points, colours


def test_a_curved_surface_is_met_where_it_is():
    """A paraboloid, tilted: a quadratic piece is exact."""
    rng = np.random.default_rng(1)
    tilt = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    flat = rng.uniform(-1, 1, (3000, 2))
    cloud = np.column_stack([flat, 0.2 * (flat**2).sum(1)])
    at = rng.uniform(-0.5, 0.5, (50, 2))
    true = np.column_stack([at, 0.2 * (at**2).sum(1)])
    normal = np.column_stack([-0.4 * at, np.ones(50)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    pieces = local_pieces(cloud @ tilt.T, true @ tilt.T)
    np.testing.assert_allclose(pieces.feet, true @ tilt.T, atol=2e-4)
    cosine = (pieces.normals * (normal @ tilt.T)).sum(1)
    np.testing.assert_allclose(np.abs(cosine), 1, atol=1e-3)
    np.testing.assert_allclose(np.einsum("nck,nc->nk", pieces.axes, normal @ tilt.T), 0, atol=0.05)
    assert pieces.flat.min() > 0.98
    lifted = towards_surface(cloud @ tilt.T, (true + 0.02 * normal) @ tilt.T)
    np.testing.assert_allclose(lifted, true @ tilt.T, atol=2e-3)


def test_a_ball_of_points_is_no_surface():
    cloud = np.random.default_rng(2).normal(size=(4000, 3))
    assert local_pieces(cloud, np.zeros((1, 3))).flat[0] < 0.7


def test_colour_is_one_of_those_there_not_a_mean():
    red, blue = [1.0, 0, 0], [0.0, 0, 1]
    found = medoid_colours(np.array([[red, red, blue, red, blue], [blue, red, blue, blue, red]]))
    np.testing.assert_array_equal(found, [red, blue])


def test_noise_goes_and_edges_of_colour_stay():
    points, colours = noisy_sphere()
    before = np.abs(np.linalg.norm(points, axis=1) - 0.4).mean()
    samples = surface_of_cloud(points, colours, 6000)
    radius = np.linalg.norm(samples.points, axis=1)
    assert len(samples.points) == 6000
    assert np.abs(radius - 0.4).mean() < 0.6 * before
    cosine = np.abs((samples.points / radius[:, None] * samples.normals).sum(1))
    assert cosine.mean() > 0.97
    # Every colour is one of the two, and right but for a narrow band along the edge.
    assert set(np.unique(samples.colours)) == {0.0, 1.0}
    sure = np.abs(samples.points[:, 2]) > 0.06
    np.testing.assert_array_equal(samples.colours[sure, 0], samples.points[sure, 2] > 0)
    # Evenly spread: nobody has much less room than the others.
    assert samples.spacing.min() > 0.4 * samples.spacing.mean()
