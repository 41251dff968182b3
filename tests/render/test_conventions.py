"""Numbers worked out by hand: where a splat lands, how bright it is, what lies behind it."""

import math

import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core.errors import InputError
from jaxphys.core.splats import Splats
from jaxphys.render import (
    Camera,
    Settings,
    look_at,
    mean_depth,
    orbit,
    position,
    project,
    render,
    to_camera,
    to_pixels,
)


def straight_camera(width=32, height=24, focal=20.0):
    return Camera(
        jnp.eye(3),
        jnp.zeros(3),
        jnp.array([focal, focal]),
        jnp.array([0.5 * width, 0.5 * height]),
        width,
        height,
    )


def ball(mean, variance, opacity, colour):
    return Splats(
        jnp.array([mean]),
        variance * jnp.eye(3)[None],
        jnp.array([opacity]),
        jnp.array([colour]),
    )


def test_golden_pixel():
    # A mean at z = 2 and x = 0.05 lands at 20 * 0.05 / 2 + 16 = 16.5: the middle of pixel 16, and
    # likewise row 12. Its variance is 20^2 / 2^2 * 0.01 + 0.3 = 1.3 on the optical axis to 1e-3.
    splats = ball([0.05, 0.05, 2.0], 0.01, 0.8, [1.0, 0.5, 0.25])
    image = render(splats, straight_camera(), background=jnp.array([0.0, 0.0, 1.0]))
    assert float(image.alpha[12, 16]) == pytest.approx(0.8, abs=1e-12)
    np.testing.assert_allclose(image.colour[12, 16], [0.8, 0.4, 0.8 * 0.25 + 0.2], atol=1e-12)
    assert float(image.depth[12, 16]) == pytest.approx(1.6, abs=1e-12)
    assert float(mean_depth(image)[12, 16]) == pytest.approx(2.0, abs=1e-12)
    assert float(image.alpha[12, 17]) == pytest.approx(0.8 * math.exp(-0.5 / 1.3), rel=1e-3)
    # x to the right, y down: the neighbours on both sides are alike, a far pixel is empty.
    assert float(image.alpha[12, 15]) == pytest.approx(float(image.alpha[12, 17]), rel=1e-12)
    assert image.alpha[0, 0] == 0 and mean_depth(image)[0, 0] == 0
    below = render(ball([0.05, 0.25, 2.0], 0.01, 0.8, [1.0]), straight_camera())
    right = render(ball([0.25, 0.05, 2.0], 0.01, 0.8, [1.0]), straight_camera())
    assert np.argmax(below.alpha.max(1)) == 14 and np.argmax(below.alpha.max(0)) == 16
    assert np.argmax(right.alpha.max(0)) == 18 and np.argmax(right.alpha.max(1)) == 12


def test_order_clamp_and_stop():
    camera = straight_camera()
    layers = [
        ball([0.025 * z, 0.025 * z, z], 1.0, o, c)
        for z, o, c in [
            (3.0, 1.0, [0.0, 1.0]),
            (2.0, 0.25, [1.0, 0.0]),
        ]
    ]
    both = Splats(*(jnp.concatenate(leaves) for leaves in zip(*layers, strict=True)))
    image = render(both, camera)
    # The nearer one first, whatever the order in the arrays; opacity 1 is clamped to 0.99.
    np.testing.assert_allclose(image.colour[12, 16], [0.25, 0.75 * 0.99], atol=1e-12)
    # 1e-2 * 1e-2 is not below 1e-4 but for rounding; a third opaque layer is beyond the stop.
    three = ball([0.05, 0.05, 2.0], 1.0, 0.999, [1.0])
    stack = Splats(*(jnp.concatenate([leaf] * 3) for leaf in three))
    lit = render(stack, camera, settings=Settings(alpha_max=0.98)).alpha[12, 16]
    assert float(lit) == pytest.approx(1 - 0.02**2, abs=1e-9)


def test_skip_below_one_in_255():
    camera = straight_camera()
    seen = render(ball([0.05, 0.05, 2.0], 0.01, 1.01 / 255, [1.0]), camera)
    unseen = render(ball([0.05, 0.05, 2.0], 0.01, 0.99 / 255, [1.0]), camera)
    assert seen.alpha.max() > 0.0039 and int((seen.alpha > 0).sum()) == 1
    assert unseen.alpha.max() == 0 and int(unseen.required) == 0


def test_presets():
    inria, gsplat = Settings.inria(), Settings.gsplat()
    assert (inria.near, inria.alpha_max, inria.extent) == (0.2, 0.99, "three_sigma")
    assert inria.jacobian_clamp == "symmetric" and inria.gradient_through_clamp
    assert (gsplat.near, gsplat.alpha_max, gsplat.extent) == (0.01, 0.999, "alpha")
    assert gsplat.jacobian_clamp == "principal" and not gsplat.gradient_through_clamp
    near = ball([0.0, 0.0, 0.1], 1e-6, 0.9, [1.0])
    assert render(near, straight_camera(), settings=gsplat).alpha.max() > 0.4
    assert render(near, straight_camera(), settings=inria).alpha.max() == 0


def test_clamps_agree_for_a_centred_principal_point():
    splats = ball([3.0, 2.0, 1.0], 0.01, 0.9, [1.0])
    camera = straight_camera()
    symmetric = project(splats, camera, Settings(jacobian_clamp="symmetric"))
    principal = project(splats, camera, Settings(jacobian_clamp="principal"))
    free = project(splats, camera, Settings(jacobian_clamp="none"))
    np.testing.assert_allclose(symmetric.factors, principal.factors, rtol=1e-12)
    assert np.abs(free.factors / symmetric.factors - 1).max() > 0.1


def test_look_at_and_orbit():
    camera = look_at(jnp.array([3.0, 0.0, 1.0]), (0.0, 0.0, 1.0), width=40, height=20)
    R = camera.rotation
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert float(jnp.linalg.det(R)) == pytest.approx(1.0)
    np.testing.assert_allclose(position(camera), [3.0, 0.0, 1.0], atol=1e-12)
    points = jnp.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.1], [0.0, 0.1, 1.0]])
    middle, above, to_the_right = to_pixels(camera, points)
    np.testing.assert_allclose(middle, [20.0, 10.0], atol=1e-9)
    # Up is up in the picture (rows grow downwards); +y is to the right when looking along -x.
    assert above[1] < 10 and float(above[0]) == pytest.approx(20)
    assert to_the_right[0] > 20 and float(to_the_right[1]) == pytest.approx(10)
    np.testing.assert_allclose(to_camera(camera, points)[0], [0, 0, 3], atol=1e-12)
    down = orbit((0.0, 0.0, 0.0), 2.0, 0.3, math.pi / 2, width=8, height=8)
    assert np.isfinite(np.asarray(down.rotation)).all()
    np.testing.assert_allclose(position(down), [0, 0, 2], atol=1e-6)
    same = look_at((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), width=8, height=8)
    assert np.isfinite(np.asarray(same.rotation)).all()


def test_errors_name_the_remedy():
    splats = ball([0.05, 0.05, 2.0], 0.01, 0.8, [1.0, 0.5, 0.25])
    with pytest.raises(InputError, match="alpha_max"):
        Settings(alpha_max=1.0)
    with pytest.raises(InputError, match="did you mean"):
        Settings(extent="alfa")
    with pytest.raises(InputError, match="must divide 16"):
        Settings.inria(tile_size=12)
    with pytest.raises(InputError, match="background"):
        render(splats, straight_camera(), background=jnp.zeros(2))
    with pytest.raises(InputError, match=r"splats\.opacities"):
        render(splats._replace(opacities=jnp.zeros((1, 1))), straight_camera())
    with pytest.raises(InputError, match="capacity"):
        render(splats, straight_camera(), capacity=0)
    with pytest.raises(InputError, match="field_of_view"):
        look_at((1.0, 0, 0), (0.0, 0, 0), field_of_view=4.0, width=8, height=8)
