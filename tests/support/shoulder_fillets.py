"""Stress concentration of a bar that narrows, by a handbook's formula."""

from __future__ import annotations

import math

# Coefficients of [R] W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 7th ed., table 17.1, case 5:
# rows of 1, sqrt(h/r), h/r; for tension those of h/r up to 2 and beyond
SHOULDER = {
    "bending": ((1.007, 1.0, -0.031), (-0.270, -2.404, 0.749), (0.677, 1.133, -0.904), (-0.414, 0.271, 0.186)),
    "tension": ((1.007, 1.0, -0.031), (-0.114, -0.585, 0.314), (0.241, -0.992, -0.271), (-0.134, 0.577, -0.012)),
}
SHARP_SHOULDER = {
    "bending": ((1.042, 0.982, -0.036), (-3.599, 1.619, -0.431), (6.084, -5.607, 1.158), (-2.527, 3.006, -0.691)),
    "tension": ((1.042, 0.982, -0.036), (-0.074, -0.156, -0.010), (-3.418, 1.220, -0.005), (3.450, -2.046, 0.051)),
}


def handbook(load: str, wide: float, narrow: float, radius: float) -> float:
    """Return the factor for "tension" or "bending" of a bar that narrows on both sides; sizes in one unit."""
    step = 0.5 * (wide - narrow)
    rows = (SHOULDER if step / radius <= 2 else SHARP_SHOULDER)[load]
    factors = [a + b * math.sqrt(step / radius) + c * step / radius for a, b, c in rows]
    return sum(factor * (2 * step / wide) ** k for k, factor in enumerate(factors))
