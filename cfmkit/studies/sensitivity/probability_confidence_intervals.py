"""Confidence intervals of probabilities, and of the difference of two of them on the same samples.

Reference
---------
[W] E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
[CP] C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404.
[BP] D. G. Bonett, R. M. Price, J. Educ. Behav. Stat. 37 (2012) 479.
"""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

LEVEL = 0.95
"""Confidence of every interval."""

Interval = tuple[float, float]


def normal_quantile(level: float = LEVEL) -> float:
    """Return how many standard deviations a two-sided interval reaches.

    Examples
    --------
    >>> round(normal_quantile(0.95), 4)
    1.96
    """
    return NormalDist().inv_cdf(0.5 + level / 2.0)


def wilson(successes: int, count: int, level: float = LEVEL) -> Interval:
    """Return the score interval of a probability [W].

    Parameters
    ----------
    successes, count : int
        How often it happened, and how often it could have.
    level : float
        Confidence.

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


def clopper_pearson(successes: int, count: int, level: float = LEVEL) -> Interval:
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


def paired_difference(gained: int, lost: int, count: int, level: float = LEVEL) -> Interval:
    """Return the interval of a difference of two probabilities seen on the same samples [BP, eq. 5].

    Parameters
    ----------
    gained, lost : int
        Samples that only the second has, and that only the first has.
    count : int
        Samples.
    level : float
        Confidence.
    """
    if not count:
        return -1.0, 1.0
    up, down = (gained + 1.0) / (count + 2.0), (lost + 1.0) / (count + 2.0)
    reach = normal_quantile(level) * sqrt((up + down - (up - down) ** 2) / (count + 2.0))
    return max(-1.0, up - down - reach), min(1.0, up - down + reach)
