"""Whether the installed JAX computes what it should, on programs of the shape used here."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from jaxphys.core.errors import one_line

ROWS = 40_000
ADVICE = (
    "This JAX computes wrong numbers: install another, for example\n"
    '  pip install "jax>=0.10,!=0.10.2,!=0.11.0,!=0.11.1"\n'
    "and if it is one that should be right, report it with the lines above."
)


def _mapped_product() -> tuple[float, float]:
    """A mapped matrix-vector product with a reduction: jaxlib 0.10.2 gets it wrong on the CPU
    beyond
    32,768 rows of float32 (jax-ml/jax issue 39103). Relative error and what is allowed.
    """
    values = np.zeros((ROWS, 3), np.float32)
    values[:, 0] = np.arange(ROWS)
    matrix = jnp.eye(3, dtype=jnp.float32)
    norms = jax.jit(jax.vmap(lambda row: jnp.sum((matrix @ row) ** 2)))(values)
    exact = values[:, 0].astype(np.float64) ** 2
    return _relative(norms, exact), 1e-5


def _inputs() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(0)
    positions = random.uniform(1, 14, (3, ROWS)).astype(np.float32)
    return positions, random.normal(size=(3, ROWS)).astype(np.float32)


def _scatter_sums(values, positions, xp):
    """Sums of the values of all particles in a cell, weighted by distance: particle to grid."""
    cells = positions.astype(xp.int32)
    weights = (1 - (positions - cells)).prod(axis=0)
    index = (cells[0] * 16 + cells[1]) * 16 + cells[2]
    rows = (weights * values).T
    if xp is np:
        grid = np.zeros((16**3, 3))
        np.add.at(grid, index, rows)
        return grid
    return jnp.zeros((16**3, 3), rows.dtype).at[index].add(rows)


def _scatter() -> tuple[float, float]:
    positions, values = _inputs()
    ours = jax.jit(lambda v, x: _scatter_sums(v, x, jnp))(values, positions)
    exact = _scatter_sums(values.astype(np.float64), positions.astype(np.float64), np)
    return _relative(ours, exact), 1e-5


def _gradient() -> tuple[float, float]:
    """The gradient of |P v|^2, which is 2 P^T P v for the linear map P above."""
    positions, values = _inputs()
    ours = jax.jit(jax.grad(lambda v: jnp.sum(_scatter_sums(v, positions, jnp) ** 2)))(values)
    x = positions.astype(np.float64)
    grid = _scatter_sums(values.astype(np.float64), x, np)
    cells = x.astype(np.int32)
    index = (cells[0] * 16 + cells[1]) * 16 + cells[2]
    exact = 2 * (1 - (x - cells)).prod(axis=0) * grid[index].T
    return _relative(ours, exact), 1e-4


def _relative(ours, exact: np.ndarray) -> float:
    return float(np.max(np.abs(np.asarray(ours, np.float64) - exact)) / np.max(np.abs(exact)))


CHECKS: dict[str, Callable[[], tuple[float, float]]] = {
    "mapped product and sum, 40,000 rows": _mapped_product,
    "particles to grid": _scatter,
    "gradient of particles to grid": _gradient,
}


def _device_line() -> str:
    device = jax.devices()[0]
    return f"jax {jax.__version__} on {device.platform} ({device.device_kind})"


def _check_line(name: str, check: Callable[[], tuple[float, float]]) -> tuple[bool, str]:
    error, allowed = check()
    good = error <= allowed
    return good, f"{'ok  ' if good else 'FAIL'} {name}: error {error:.1e}, allowed {allowed:.0e}"


def report(checks: dict[str, Callable[[], tuple[float, float]]] = CHECKS) -> tuple[str, bool]:
    """A line for each check against float64 numpy, with advice if one fails, and whether all
    hold. A check that raises has failed; the others are made all the same.
    """
    lines, healthy = [], True
    try:
        lines.append(_device_line())
    except Exception as error:  # of a JAX that does not work, anything can be expected
        why = f"{type(error).__name__}: {error}"
        return one_line(f"FAIL jax {jax.__version__}: finds no device ({why})"), False
    for name, check in checks.items():
        try:
            good, line = _check_line(name, check)
        except Exception as error:
            good, line = False, one_line(f"FAIL {name}: raised {type(error).__name__}: {error}")
        healthy &= good
        lines.append(line)
    if not healthy:
        lines.append(ADVICE)
    return "\n".join(lines), healthy
