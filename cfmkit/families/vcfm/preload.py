"""The paper's rules for the preload, from stated stiffnesses.

[D] takes the force to rise by K_p dr (eq. 3), and the shuttle to move back by K_p dr/(K_p + K_b1) (eq. 6). The first is
exact where K_p = K_n and both are constant; the second is not: pulled back, the leaves are in tension and stiffen.

Reference
---------
[D] B. Ding, X. Li, Y. Li, Robotica (2022), eq. 1-6 and Table II.
"""

from __future__ import annotations

from typing import Any


def force_change(positive_stiffness: Any, preload: Any) -> Any:
    """Return K_p dr, the change of the constant force [N].

    Examples
    --------
    >>> force_change(1400.0, 2.5e-3)
    3.5
    """
    return positive_stiffness * preload


def rest_shift(positive_stiffness: Any, first_stiffness: Any, preload: Any) -> Any:
    """Return how far the preload moves the shuttle back, by constant stiffnesses [m] [D, eq. 6]."""
    return positive_stiffness * preload / (positive_stiffness + first_stiffness)


def measured_stiffness_for(force: float, balance: float) -> float:
    """Return the K_p that a force at the balance point needs without preload [N/m]: the leaves carry nothing there."""
    return force / balance
