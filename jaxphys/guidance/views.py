"""The cameras that the bundled priors were trained with: one convention for training and use.

An object is centred at the origin with its longest side 1, z up, front facing +x. A view is an
azimuth (0 looks at the front from +x, pi/2 from +y) and an elevation above the horizon; the camera
stands `DISTANCE` away, looks at the origin with +z up in the picture and sees `FIELD_OF_VIEW`.

Colours of points and pictures carry a baked soft top light: albedo times
`AMBIENT + DIFFUSE * n_z`, n the outward normal, so that shape shows without a lighting model.
"""

import numpy as np

DISTANCE = 2.5  # in object lengths
FIELD_OF_VIEW = float(np.deg2rad(34.0))  # full angle, both directions
RESOLUTION = 64  # pixels a side
ELEVATIONS = (float(np.deg2rad(-20.0)), float(np.deg2rad(70.0)))  # range of training views
AMBIENT, DIFFUSE = 0.78, 0.22
FEATURES = 4


def view_features(azimuth, elevation, known=True, xp=np):
    """What the pixel prior is told of a view: (..., 4) = (sin azimuth, cos azimuth, elevation
    [rad], 1).

    All zero where `known` is false: pictures of which only the name is known (the emoji).
    `xp` is numpy or jax.numpy.
    """
    azimuth, elevation = xp.asarray(azimuth), xp.asarray(elevation)
    features = xp.stack(
        [xp.sin(azimuth), xp.cos(azimuth), elevation + 0 * azimuth, 1 + 0 * azimuth], -1
    )
    return features * xp.asarray(known, features.dtype)[..., None]


def camera_position(azimuth, elevation, distance: float = DISTANCE, xp=np):
    """Where the camera of a view stands, (..., 3), in the object's frame."""
    azimuth, elevation = xp.asarray(azimuth), xp.asarray(elevation)
    level = xp.cos(elevation)
    return distance * xp.stack(
        [level * xp.cos(azimuth), level * xp.sin(azimuth), xp.sin(elevation) + 0 * azimuth], -1
    )


def lit(colours, normals):
    """Albedo (N, 3) in [0, 1] under the soft top light, with outward unit normals (N, 3)."""
    return np.clip(colours * (AMBIENT + DIFFUSE * normals[:, 2:]), 0, 1)
