"""What a closed mesh says of a rigid body: volume, centre of mass, inertia, where it touches."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from jaxphys.core.errors import InputError
from jaxphys.gaussians.signed_distance import require_closed

MOST_POINTS = 32


class SolidMesh(NamedTuple):
    """A mesh whose bounding box has its centre at 0 and a longest side of 1, evenly filled.

    volume: (); middle: its centre of mass, (3,); inertia: about that, of unit density, (3, 3);
    area: of its surface, (); levers: the largest squared distance from the centre of mass, (3,);
    points: corners of its hull, (3, P); radius: 0.
    """

    volume: np.ndarray
    middle: np.ndarray
    inertia: np.ndarray
    area: np.ndarray
    levers: np.ndarray
    points: np.ndarray
    radius: np.ndarray


def solid_mesh(triangles: np.ndarray) -> SolidMesh:
    """Of a closed mesh (F, 3, 3), its triangles turned one way, outwards or inwards.

    Integrals over the cones from 0 to each triangle (Tonon 2004).

    Raises:
        InputError: it is not closed, or encloses nothing.
    """
    require_closed(triangles)
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    triangles = (triangles - (low + high) / 2) / np.max(high - low)
    cones = np.linalg.det(triangles)
    total = triangles.sum(axis=1)
    volume = cones.sum() / 6
    if not abs(volume) > 1e-9:
        raise InputError("the mesh encloses no volume; give it thickness")
    middle = cones @ total / 24 / volume
    squares = np.einsum("f,fki,fkj->ij", cones, triangles, triangles)
    squares = (squares + np.einsum("f,fi,fj->ij", cones, total, total)) / 120
    squares = np.sign(volume) * squares - abs(volume) * np.outer(middle, middle)
    corners = triangles.reshape(-1, 3)
    corners = corners[ConvexHull(corners).vertices]
    area = 0.5 * np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    return SolidMesh(
        volume=abs(volume),
        middle=middle,
        inertia=np.trace(squares) * np.eye(3) - squares,
        area=area.sum(),
        levers=np.full(3, np.max(np.sum((corners - middle) ** 2, axis=1))),
        points=spread(corners, MOST_POINTS).T,
        radius=np.zeros(()),
    )


def spread(points: np.ndarray, most: int) -> np.ndarray:
    """At most so many of points (P, 3), each the farthest from those before it."""
    chosen = [int(np.argmax(np.sum((points - points.mean(axis=0)) ** 2, axis=1)))]
    nearest = np.full(len(points), np.inf)
    while len(chosen) < min(most, len(points)):
        nearest = np.minimum(nearest, np.sum((points - points[chosen[-1]]) ** 2, axis=1))
        chosen.append(int(np.argmax(nearest)))
    return points[chosen]
