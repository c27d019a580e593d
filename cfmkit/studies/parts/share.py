"""A yield counted in parts, with its confidence intervals, and the interval of a difference of two yields.

Reference
---------
[W] E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
[CP] C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404.
[BP] D. G. Bonett, R. M. Price, J. Educ. Behav. Stat. 37 (2012) 479.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan, sqrt
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

CONFIDENCE_LEVEL = 0.95  # confidence of every interval

Interval = tuple[float, float]


@dataclass(frozen=True)
class Share:
    """Parts that are good among all that were drawn."""

    good: int  # parts that meet everything
    failed: int  # parts without a complete result, which count as bad
    count: int  # all parts
    why: str = ""  # what became of the first failed part

    @classmethod
    def from_outcomes(cls, met: NDArray[np.bool_], failed: NDArray[np.bool_], why: str = "") -> Share:
        """Return the share of parts that meet what they should, (n,), of which some failed."""
        return cls(int((met & ~failed).sum()), int(failed.sum()), len(met), why)

    @property
    def value(self) -> float:
        """The share; NaN of no parts."""
        return self.good / self.count if self.count else nan

    @property
    def wilson(self) -> Interval:
        """Score interval of the share [W]."""
        return wilson(self.good, self.count) if self.count else (nan, nan)

    @property
    def clopper_pearson(self) -> Interval:
        """Exact interval of the share [CP]."""
        return clopper_pearson(self.good, self.count) if self.count else (nan, nan)

    def excludes(self, wanted: float) -> bool:
        """Return True if so few parts are good that the wanted share is out of the question, with 95 % confidence."""
        return self.clopper_pearson[1] < wanted

    def as_json(self) -> dict[str, Any]:
        """Return what metrics.json says of it, with both intervals; null for what cannot be stated."""
        intervals = {
            name: [_finite_or_none(end) for end in getattr(self, name)] for name in ("wilson", "clopper_pearson")
        }
        counts = {"good": self.good, "failed": self.failed, "parts": self.count}
        return {"value": _finite_or_none(self.value), **intervals, "level": CONFIDENCE_LEVEL, **counts}


def _finite_or_none(value: float) -> float | None:
    return None if isnan(value) else value


def percent(share: float) -> str:
    """Return a share in percent, to three digits."""
    return f"{100.0 * share:.3g} %"


def normal_quantile(level: float = CONFIDENCE_LEVEL) -> float:
    """Return how many standard deviations a two-sided interval reaches.

    Examples
    --------
    >>> round(normal_quantile(0.95), 4)
    1.96
    """
    return NormalDist().inv_cdf(0.5 + level / 2.0)


def wilson(successes: int, count: int, level: float = CONFIDENCE_LEVEL) -> Interval:
    """Return the score interval of a probability [W].

    Examples
    --------
    >>> low, high = wilson(90, 100)
    >>> round(low, 4), round(high, 4)
    (0.8256, 0.9448)
    """
    if not count:
        return 0.0, 1.0
    z, share = normal_quantile(level), successes / count
    centre = share + z * z / (2.0 * count)
    reach = z * sqrt(share * (1.0 - share) / count + (z / (2.0 * count)) ** 2)
    scale = 1.0 + z * z / count
    low = 0.0 if successes == 0 else (centre - reach) / scale
    return low, 1.0 if successes == count else (centre + reach) / scale


def clopper_pearson(successes: int, count: int, level: float = CONFIDENCE_LEVEL) -> Interval:
    """Return the exact interval of a probability: it covers the truth at least as often as stated [CP].

    Examples
    --------
    >>> low, high = clopper_pearson(90, 100)
    >>> round(low, 4), round(high, 4)
    (0.8238, 0.951)
    """
    from scipy.special import betaincinv

    tail = (1.0 - level) / 2.0
    low = 0.0 if not successes else float(betaincinv(successes, count - successes + 1, tail))
    high = 1.0 if successes == count else float(betaincinv(successes + 1, count - successes, 1.0 - tail))
    return low, high


def paired_difference(gained: int, lost: int, count: int, level: float = CONFIDENCE_LEVEL) -> Interval:
    """Return the interval of a difference of two probabilities seen on the same samples [BP, eq. 5].

    `gained`, `lost`: samples that only the second has, and that only the first has.
    """
    if not count:
        return -1.0, 1.0
    up, down = (gained + 1.0) / (count + 2.0), (lost + 1.0) / (count + 2.0)
    reach = normal_quantile(level) * sqrt((up + down - (up - down) ** 2) / (count + 2.0))
    return max(-1.0, up - down - reach), min(1.0, up - down + reach)
