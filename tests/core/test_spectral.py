import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxphys.core import algebra, spectral


@pytest.fixture
def random():
    """Each test draws from a generator of its own: no test depends on those before it."""
    return np.random.default_rng(11)


def rotations(count, random):
    Q = np.linalg.qr(random.normal(size=(count, 3, 3)))[0]
    return Q * np.sign(np.linalg.det(Q))[:, None, None]


def with_stretches(stretches, random, count=40):
    """(3, 3, count) with these singular values between random rotations; a negative one inverts."""
    U, V = rotations(count, random), rotations(count, random)
    return np.einsum("nik,k,njk->ijn", U, np.asarray(stretches, float), V)


STRETCHES = {
    "rotation": [1, 1, 1],
    "repeated pair": [1.3, 1.3, 0.7],
    "nearly repeated": [1.3, 1.3 + 1e-7, 0.7],
    "distinct": [1.6, 1.1, 0.5],
    "inverted": [1.4, 0.9, -0.4],
    "inverted pair": [1.2, 1.2, -0.5],
}
CASES = {"identity": np.repeat(np.eye(3)[:, :, None], 3, axis=2)} | {
    name: with_stretches(stretches, np.random.default_rng(seed))
    for seed, (name, stretches) in enumerate(STRETCHES.items())
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("spread", ["random", "pair", "near pair", "triple", "diagonal", "zero"])
def test_eigen_decomposition(dtype, spread, random):
    w = random.normal(size=(500, 3))
    Q = rotations(500, random)
    if spread in ("pair", "near pair"):
        w[:, 1] = w[:, 0] + (1e-5 * w[:, 1] if spread == "near pair" else 0)
    if spread == "triple":
        w[:] = w[:, :1]
    if spread == "zero":
        w[:] = 0
    if spread == "diagonal":
        Q[:] = np.eye(3)
        w[::2, 2] = w[::2, 0]
    A = np.einsum("nik,nk,njk->ijn", Q, w, Q).astype(dtype)
    values, vectors = jax.jit(spectral.eigen_symmetric)(A)
    assert values.dtype == vectors.dtype == dtype
    values, vectors = np.asarray(values, float), np.asarray(vectors, float)
    eps = np.finfo(dtype).eps
    scale = np.maximum(np.abs(A).max((0, 1)).astype(float), 1e-30)
    rebuilt = np.einsum("ikn,kn,jkn->ijn", vectors, values, vectors)
    assert (np.abs(rebuilt - A).max((0, 1)) / scale).max() < 20 * eps
    gram = np.einsum("kin,kjn->ijn", vectors, vectors)
    assert np.abs(gram - np.eye(3)[:, :, None]).max() < 10 * eps
    exact = np.linalg.eigvalsh(np.moveaxis(A.astype(float), -1, 0)).T
    assert (np.abs(np.sort(values, 0) - exact).max(0) / scale).max() < 20 * eps


def test_eigenvalue_derivatives_where_they_differ(random):
    A = np.diag([3.0, 1.0, -2.0]) + 0.1 * (lambda B: B + B.T)(random.normal(size=(3, 3)))
    dA = (lambda B: B + B.T)(random.normal(size=(3, 3)))

    def invariant(A):
        w, Q = spectral.eigen_symmetric(A)
        return jnp.sum(w**3) + jnp.sum((Q * jnp.exp(w)) @ Q.T * jnp.arange(9.0).reshape(3, 3))

    _, slope = jax.jvp(invariant, (A,), (dA,))
    h = 1e-6
    difference = (invariant(A + h * dA) - invariant(A - h * dA)) / (2 * h)
    assert float(slope) == pytest.approx(float(difference), rel=1e-6)


def test_small_strains_keep_their_digits(random):
    H = (1e-3 * random.normal(size=(3, 3, 50))).astype(np.float32)
    F = (np.eye(3)[:, :, None] + H).astype(np.float32)
    exact = F.astype(float)
    left = np.einsum("ikn,jkn->ijn", exact, exact) - np.eye(3)[:, :, None]
    np.testing.assert_allclose(spectral.left_strain(F), left, atol=2e-9)
    volume = np.linalg.det(np.moveaxis(exact, -1, 0)) - 1
    np.testing.assert_allclose(spectral.volume_change(F), volume, atol=2e-9)
    naive = np.einsum("ikn,jkn->ijn", F, F) - np.eye(3, dtype=np.float32)[:, :, None]
    assert np.abs(naive - left).max() > 3e-8  # what the form above avoids


def exact_polar(F):
    U, _, Vt = np.linalg.svd(np.moveaxis(F, -1, 0))
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    return np.moveaxis(U @ Vt, 0, -1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("case", CASES)
def test_polar_rotation(case, dtype):
    F = CASES[case].astype(dtype)
    R = jax.jit(spectral.polar_rotation)(F)
    assert R.dtype == dtype
    np.testing.assert_allclose(R, exact_polar(F.astype(float)), atol=40 * np.finfo(dtype).eps)
    np.testing.assert_allclose(algebra.determinant(R), 1, atol=20 * np.finfo(dtype).eps)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_polar_rotation_of_strongly_stretched_matrices(scale, random):
    F = scale * with_stretches([20.0, 1.0, 0.3], random)
    np.testing.assert_allclose(spectral.polar_rotation(F), exact_polar(F), atol=1e-11)


@pytest.mark.parametrize("shear", [0.3, -0.3])
@pytest.mark.parametrize("plane", [(0, 1), (0, 2), (1, 2)])
def test_symmetric_strains_lie_aside_of_every_choice(plane, shear, random):
    """Rounding, of whichever sign, does not exchange or turn the eigenvectors of a pure shear."""
    A = np.zeros((3, 3))
    A[plane] = A[plane[::-1]] = shear
    noise = random.normal(size=(3, 3, 50))
    noise = 1e-9 * (noise + noise.swapaxes(0, 1))
    decompose = jax.jit(spectral.eigen_symmetric)
    for one, other in zip(
        decompose(A[..., None] + noise), decompose(A[..., None] - noise), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-7)


def hencky(e, arguments):
    weight, bulk = arguments
    total = e[0] + e[1] + e[2]
    return (weight * jnp.sin(2 * e) + bulk * total, e**2), (jnp.sum(e**3, axis=0) * weight,)


def reference(F, arguments):
    """The same function through a dense eigen-decomposition in numpy."""
    f = np.moveaxis(F, -1, 0)
    w, Q = np.linalg.eigh(f @ f.swapaxes(1, 2))
    values, scalars = hencky(jnp.asarray(0.5 * np.log(w.T)), arguments)
    return [np.einsum("nik,kn,njk->ijn", Q, v, Q) for v in values] + list(scalars)


@pytest.mark.parametrize("case", CASES)
def test_isotropic_functions_and_their_derivatives(case, random):
    F = CASES[case]
    count = F.shape[-1]
    arguments = (1.5 + random.random(count), random.random(count))
    direction = random.normal(size=F.shape)
    changes = tuple(random.normal(size=count) for _ in arguments)

    evaluate = jax.jit(lambda F, a: spectral.left_isotropic(hencky, F, a))
    for got, expected in zip(
        jax.tree.leaves(evaluate(F, arguments)), reference(F, arguments), strict=True
    ):
        np.testing.assert_allclose(got, expected, atol=1e-13)

    _, tangents = jax.jvp(evaluate, (F, arguments), (direction, changes))
    h = 1e-5
    ahead = reference(
        F + h * direction, [a + h * c for a, c in zip(arguments, changes, strict=True)]
    )
    behind = reference(
        F - h * direction, [a - h * c for a, c in zip(arguments, changes, strict=True)]
    )
    for tangent, up, down in zip(jax.tree.leaves(tangents), ahead, behind, strict=True):
        np.testing.assert_allclose(tangent, (up - down) / (2 * h), atol=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_polar_rotation_derivative(case, random):
    F = CASES[case]
    direction = random.normal(size=F.shape)
    _, tangent = jax.jvp(spectral.polar_rotation, (F,), (direction,))
    h = 1e-6
    difference = (exact_polar(F + h * direction) - exact_polar(F - h * direction)) / (2 * h)
    np.testing.assert_allclose(tangent, difference, atol=1e-7)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("case", CASES)
def test_reverse_mode_agrees_with_forward_mode(case, dtype, random):
    F = jnp.asarray(CASES[case], dtype)
    arguments = (jnp.full(F.shape[-1], 2, dtype), jnp.ones(F.shape[-1], dtype))
    direction = jnp.asarray(random.normal(size=F.shape), dtype)

    def loss(F):
        (a, b), (c,) = spectral.left_isotropic(hencky, F, arguments)
        weight = jnp.arange(9, dtype=dtype).reshape(3, 3, 1)
        return jnp.sum(weight * (a + b + spectral.polar_rotation(F))) + jnp.sum(c)

    gradient = jax.grad(loss)(F)
    assert gradient.dtype == dtype
    assert np.isfinite(gradient).all()
    _, forward = jax.jvp(loss, (F,), (direction,))
    tolerance = 1e-10 if dtype == np.float64 else 2e-3
    assert np.sum(gradient * direction) == pytest.approx(float(forward), rel=tolerance, abs=1e-2)


def test_gradients_in_float32_are_those_of_float64(random):
    near_rest = np.eye(3)[:, :, None] + 1e-3 * random.normal(size=(3, 3, 100))
    gradients = []
    for dtype in (np.float32, np.float64):
        F = jnp.asarray(near_rest.astype(np.float32), dtype)
        arguments = (jnp.ones(100, dtype), jnp.ones(100, dtype))

        def loss(F, arguments=arguments):
            return jnp.sum(spectral.left_isotropic(hencky, F, arguments)[0][0][1])

        gradients.append(np.asarray(jax.grad(loss)(F), float))
    np.testing.assert_allclose(gradients[0], gradients[1], atol=1e-3)


def test_the_derivative_of_a_singular_value_decomposition_fails_where_ours_holds():
    def through_svd(F):
        U, _, Vt = jnp.linalg.svd(F)
        return jnp.sum((U @ Vt) ** 3)

    F = jnp.eye(3)
    assert not np.isfinite(jax.grad(through_svd)(F)).all()
    assert np.isfinite(jax.grad(lambda F: jnp.sum(spectral.polar_rotation(F) ** 3))(F)).all()


def test_second_derivatives_of_the_polar_rotation(random):
    F = jnp.asarray(with_stretches([1.2, 1.2, 0.8], random, 1)[:, :, 0])
    dF = jnp.asarray(random.normal(size=(3, 3)))

    def along(t):
        return spectral.polar_rotation(F + t * dF)

    curvature = jax.jacfwd(jax.jacfwd(along))(0.0)
    h = 1e-3
    samples = [exact_polar(np.asarray(F + t * dF)[:, :, None])[:, :, 0] for t in (-h, 0, h)]
    difference = (samples[0] - 2 * samples[1] + samples[2]) / h**2
    np.testing.assert_allclose(curvature, difference, atol=1e-4)


def test_a_flattened_particle_stays_finite(random):
    F = jnp.asarray(with_stretches([1.0, 0.5, 0.0], random, 5), jnp.float32)
    arguments = (jnp.ones(5, jnp.float32), jnp.ones(5, jnp.float32))

    def loss(F):
        parts = jax.tree.leaves(spectral.left_isotropic(hencky, F, arguments))
        return sum(jnp.sum(part) for part in parts)

    value, gradient = jax.value_and_grad(loss)(F)
    assert np.isfinite(value) and np.isfinite(gradient).all()
    R = spectral.polar_rotation(F)
    np.testing.assert_allclose(algebra.determinant(R), 1, atol=1e-4)
