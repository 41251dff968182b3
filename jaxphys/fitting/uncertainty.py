"""How sure a fit is: what the residuals at the end say about each number, and which they do not
determine.

The likelihood near its top is taken as a Gaussian (Laplace): with J the derivatives of the
residuals, the covariance is s^2 (J^T J)^-1. Residuals that lie beside each other are alike, since
most of what is left is not noise but what the model does not have; as independent pieces of
evidence they are fewer than they are. n_eff counts those: n over the time that autocorrelation
takes to fade along each axis (Sokal 1997, section 3), and s^2 = r^T r / (n_eff - p) n_eff / n of
the whole, so that (J^T J) counts n_eff residuals, not n.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from jaxphys.fitting.layout import Layout

DECADE = 1.0  # in units of what is much: wider than that, a direction is not determined


@dataclass(frozen=True)
class Uncertainty:
    """How sure each number is.

    Attributes:
        labels: a name for each number.
        value: (P,), in the user's units.
        low, high: ends of the interval that covers the truth with `level`, (P,); they are as far
            apart as the line of each number says: by a factor for `Log`.
        level: of the intervals.
        width: half the interval in units of what is much (`Free.scale`): decades for `Log`.
        covariance: on the line, (P, P).
        independent: how many independent residuals there are.
        undetermined: directions that the observations do not determine: each the share of each
            number in it by label, and how wide it is, in units of what is much.
    """

    labels: tuple[str, ...]
    value: np.ndarray
    low: np.ndarray
    high: np.ndarray
    level: float
    width: np.ndarray
    covariance: np.ndarray
    independent: float
    undetermined: tuple[dict[str, Any], ...]

    def __getitem__(self, label: str) -> tuple[float, float]:
        """The interval of one number, by its label."""
        at = self.labels.index(label)
        return float(self.low[at]), float(self.high[at])

    def determined(self, label: str) -> bool:
        """Whether the observations say what this number is to within a decade."""
        return bool(self.width[self.labels.index(label)] < DECADE)

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "level": self.level,
            "independent_residuals": _plain(self.independent),
            "numbers": {
                label: {
                    "value": _plain(self.value[i]),
                    "low": _plain(self.low[i]),
                    "high": _plain(self.high[i]),
                    "determined": self.determined(label),
                }
                for i, label in enumerate(self.labels)
            },
            "undetermined": list(self.undetermined),
        }


def _plain(value) -> float | None:
    """A number as JSON has it; None where there is none."""
    return float(f"{value:.7g}") if np.isfinite(value) else None


def fading(residuals: np.ndarray, axis: int) -> float:
    """How many neighbours along an axis say the same: 1 + 2 sum of the autocorrelation up to where
    it first falls below 0.05, at least 1.

    Of residuals as they are, not about their mean: what all of them are off by is no noise either.
    """
    x = np.moveaxis(np.asarray(residuals, np.float64), axis, -1).reshape(-1, residuals.shape[axis])
    count = x.shape[1]
    power = np.sum(x**2) / x.size
    if count < 2 or power == 0:
        return 1.0
    found = 1.0
    for lag in range(1, count):
        rho = np.mean(x[:, :-lag] * x[:, lag:]) / power
        if rho < 0.05:
            break
        found += 2 * rho * (1 - lag / count)
    return float(min(max(found, 1.0), count))


def independent_residuals(parts: list[np.ndarray], axes: list[tuple[int, ...]]) -> float:
    """How many independent ones arrays of residuals hold, each looked at along its own axes."""
    total = 0.0
    for part, along in zip(parts, axes, strict=True):
        counted = float(np.count_nonzero(part))
        for axis in along:
            counted /= fading(part, axis)
        total += max(counted, 1.0)
    return total


def laplace(
    layout: Layout,
    vector: np.ndarray,
    gram: np.ndarray,
    squares: float,
    count: int,
    independent: float,
    level: float = 0.9,
) -> Uncertainty:
    """The uncertainty at the end of a fit.

    Args:
        layout: of the free numbers.
        vector: where the fit ended, on the line.
        gram: J^T J there, of all residuals.
        squares: sum of their squares, (with nothing of roughness in it).
        count: how many residuals there are.
        independent: how many of them are independent.
        level: of the intervals.
    """
    scale = layout.scale(vector)
    freedom = max(independent - len(vector), 1.0)
    # A residual counts for independent / count of one.
    variance = squares / count * independent / freedom
    H = gram * np.outer(scale, scale) * (independent / count) / max(variance, 1e-300)
    eigenvalues, directions = np.linalg.eigh(0.5 * (H + H.T))
    quantile = float(stats.t.ppf(0.5 + level / 2, freedom))
    # Nothing known is a prior a hundred times as wide as what is much.
    spread = 1 / np.sqrt(np.maximum(eigenvalues, 0) + 1e-4)
    covariance = (directions * spread**2) @ directions.T
    width = quantile * np.sqrt(np.diag(covariance))
    undetermined = tuple(
        {
            "width": _plain(quantile * spread[k]),
            "direction": {
                label: round(float(share), 3)
                for label, share in zip(layout.labels, directions[:, k], strict=True)
                if abs(share) > 0.1
            },
        }
        for k in np.argsort(eigenvalues)
        if quantile * spread[k] > DECADE
    )

    def values(place):
        with np.errstate(over="ignore"):
            return np.concatenate(
                [np.asarray(v, np.float64).ravel() for v in layout.values(place).values()]
            )

    return Uncertainty(
        labels=tuple(layout.labels),
        value=values(vector),
        low=values(vector - width * scale),
        high=values(vector + width * scale),
        level=level,
        width=width,
        covariance=covariance * np.outer(scale, scale),
        independent=independent,
        undetermined=undetermined,
    )
