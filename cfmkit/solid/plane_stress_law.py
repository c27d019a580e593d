"""Plane-stress laws of isotropic elastic materials under large strain: Saint Venant-Kirchhoff and neo-Hookean.

Green's strain E = (F'F - 1)/2 and the second Piola-Kirchhoff stress S, in the order 11, 22, 12 with 2 E12. The stress
across the plane is zero: the strain there is condensed out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray

N_NEWTON_STEPS = 20  # of Newton's method for the stretch across the plane; from 1 it takes four to six


class Law(Protocol):
    """Response of a material to strain in its plane; at small strain it is that of Hooke."""

    @property
    def youngs_modulus(self) -> float:
        """At no strain [Pa]."""

    @property
    def poisson_ratio(self) -> float:
        """At no strain."""

    def __call__(self, strain: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the second Piola-Kirchhoff stress (3, ...) at Green's strain 11, 22, 2 x 12 (3, ...) [Pa].

        And its derivative with respect to the strain (3, 3, ...) [Pa], and the stretch across the plane (...): the
        thickness of the sheet now, over what it was.
        """


@dataclass(frozen=True)
class SaintVenantKirchhoff:
    """Stress linear in Green's strain: Hooke's law where strains are small, whatever the rotation."""

    youngs_modulus: float  # [Pa]
    poisson_ratio: float

    def __call__(self, strain: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return stress, tangent and stretch across the plane: see `Law`."""
        nu, stiffness = self.poisson_ratio, self.youngs_modulus / (1 - self.poisson_ratio**2)
        matrix = stiffness * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 0.5 * (1 - nu)]])
        stress = np.tensordot(matrix, strain, 1)
        tangent = np.broadcast_to(matrix.reshape(3, 3, *[1] * (strain.ndim - 1)), (3, 3, *strain.shape[1:]))
        across = np.sqrt(np.maximum(1 - 2 * nu / (1 - nu) * (strain[0] + strain[1]), 0.0))
        return stress, tangent, across


@dataclass(frozen=True)
class NeoHookean:
    """Energy mu/2 (tr C - 3) - mu ln J + lambda/2 (ln J)^2: softer than Hooke in tension, stiffer in compression."""

    youngs_modulus: float  # at no strain [Pa]
    poisson_ratio: float  # at no strain; below 0.5

    def __call__(self, strain: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return stress, tangent and stretch across the plane: see `Law`."""
        mu = 0.5 * self.youngs_modulus / (1 + self.poisson_ratio)
        lam = self.youngs_modulus * self.poisson_ratio / ((1 + self.poisson_ratio) * (1 - 2 * self.poisson_ratio))
        c11, c22, c12 = 1 + 2 * strain[0], 1 + 2 * strain[1], strain[2]
        # small strains keep their digits where 1 is never added and taken away again
        more = 2 * (strain[0] + strain[1]) + 4 * strain[0] * strain[1] - c12**2
        det = 1 + more
        with np.errstate(invalid="ignore", divide="ignore"):
            log = np.log1p(more)  # NaN where the material is turned inside out: no such state is accepted
            x = np.zeros_like(det)  # logarithm of the squared stretch across
            for _ in range(N_NEWTON_STEPS):
                # stress across, times the squared stretch: mu (c33 - 1) + lambda/2 ln(det c33) = 0
                step = (mu * np.expm1(x) + 0.5 * lam * (log + x)) / (mu * np.exp(x) + 0.5 * lam)
                x = x - np.clip(step, -1.0, 1.0)
                if not np.any(np.abs(step) > 1e-15):
                    break
            half = 0.5 * lam * (log + x)  # lambda ln J
            inverse = np.stack([c22 / det, c11 / det, -c12 / det])
            # 1 - C^-1
            missing = np.stack([2 * strain[0] * c22 - c12**2, 2 * strain[1] * c11 - c12**2, c12]) / det
        stress = half * inverse + mu * missing
        # dS/dE = lambda C^-1 x C^-1 + 2 (mu - lambda ln J) I(C^-1), less what the strain across takes back
        outer = inverse[:, None] * inverse[None]
        i11, i22, i12 = inverse
        mixed = np.stack(
            [
                np.stack([i11 * i11, i12 * i12, i11 * i12]),
                np.stack([i12 * i12, i22 * i22, i22 * i12]),
                np.stack([i11 * i12, i22 * i12, 0.5 * (i11 * i22 + i12 * i12)]),
            ]
        )
        tangent = lam * outer + 2 * (mu - half) * mixed - lam**2 / (lam + 2 * (mu - half)) * outer
        return stress, tangent, np.exp(0.5 * x)


MATERIAL_LAWS: dict[str, type[SaintVenantKirchhoff | NeoHookean]] = {
    "st-venant-kirchhoff": SaintVenantKirchhoff,
    "neo-hookean": NeoHookean,
}  # by the words of `material.law`
