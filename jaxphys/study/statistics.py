"""Means and their intervals where answers of one rater hang together."""

from dataclasses import dataclass

import numpy as np

LEVEL = 0.95
_GRID = 20_001


@dataclass(frozen=True)
class Estimates:
    """Values with intervals and what they are made of; K values.

    Attributes:
        values: (K,).
        covariance: (K, K), by raters as clusters; NaN for fewer than two.
        raters: number of clusters.
    """

    values: np.ndarray
    covariance: np.ndarray
    raters: int

    def interval(self, weights: np.ndarray, level: float = LEVEL) -> tuple[float, float, float]:
        """weights @ values and its interval at a level, by Student's t with raters - 1 degrees of
        freedom; the ends are NaN for fewer than two raters."""
        value = float(weights @ self.values)
        if self.raters < 2:
            return value, float("nan"), float("nan")
        spread = float(np.sqrt(max(weights @ self.covariance @ weights, 0.0)))
        reach = student_quantile(0.5 + level / 2, self.raters - 1) * spread
        return value, value - reach, value + reach


def student_quantile(level: float, freedom: int) -> float:
    """The quantile of Student's t, to some 1e-5 of itself.

    With t = sqrt(freedom) tan a the density of a is proportional to cos(a)^(freedom - 1).
    """
    angle = np.linspace(-np.pi / 2, np.pi / 2, _GRID)
    density = np.abs(np.cos(angle)) ** (freedom - 1)
    share = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    return float(np.sqrt(freedom) * np.tan(np.interp(level, share / share[-1], angle)))


def clustered_means(
    values: np.ndarray, groups: np.ndarray, raters: np.ndarray, count: int
) -> Estimates:
    """The mean of each of `count` groups, each of which has a value.

    The covariance is the sandwich estimate of the ratio of sums, linearised, with the factor
    R / (R - 1) for R raters (Liang and Zeger 1986): answers of one rater may hang together in any
    way, different raters are independent. Items are those of the study, not a sample of others.

    Args:
        values: (A,), one for each answer.
        groups: (A,) whole numbers below `count`.
        raters: (A,) who answered.
    """
    sizes = np.bincount(groups, minlength=count)
    means = np.bincount(groups, values, minlength=count) / sizes
    who, number = np.unique(raters, return_inverse=True)
    influence = np.zeros((len(who), count))
    np.add.at(influence, (number, groups), (values - means[groups]) / sizes[groups])
    return Estimates(means, sandwich(influence), len(who))


def sandwich(influence: np.ndarray) -> np.ndarray:
    """Covariance (K, K) of what the influences (R, K) of R raters add up to."""
    raters = len(influence)
    if raters < 2:
        return np.full((influence.shape[1],) * 2, np.nan)
    return raters / (raters - 1) * influence.T @ influence
