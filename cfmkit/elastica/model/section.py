"""Rectangular cross-sections: their thickness along the beam, deformations that count, curling of wide strips.

Bending always counts; stretching and shear by choice (theory of Reissner, 1972). A section that does not stretch
is exactly inextensible, not merely stiff.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import distinct, read_only
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


_N_SINE_SAMPLES = 64  # places of half a sine: the mean over it is smooth, and periodic


@dataclass(frozen=True)
class Taper:
    """A thickness that is linear between stations along the beam; a station given twice is a step."""

    stations: FloatArray  # (n,) fractions of the arc length, from 0 to 1, not decreasing
    values: FloatArray  # (n,) thickness there [m]

    def __post_init__(self) -> None:
        for name in ("stations", "values"):
            values = np.asarray(getattr(self, name))
            object.__setattr__(self, name, read_only(values, values.dtype if values.dtype.kind == "c" else float))
        s = self.stations
        if s.ndim != 1 or s.shape != self.values.shape or len(s) < 2:
            raise InputError("a taper needs as many values as stations, at least two of each")
        if s[0] != 0 or s[-1] != 1 or (np.diff(s.real) < 0).any():
            raise InputError("the stations of a taper must run from 0 to 1 without decreasing")
        if not (self.values.real > 0).all():
            raise InputError("every thickness of a taper must be positive")

    def interpolate(self, place: Any, inside: float) -> Any:
        """Return the thickness at places of the linear piece that holds the place `inside`."""
        i = int(np.clip(np.searchsorted(self.stations.real, inside, side="right") - 1, 0, len(self.stations) - 2))
        left, right = self.stations[i], self.stations[i + 1]
        share = (place - left) / (right - left)
        return self.values[i] * (1 - share) + self.values[i + 1] * share


@dataclass(frozen=True)
class Section:
    """A rectangular section: `thickness` in the plane of bending, `width` across it, and deformations that count.

    A `wide` one stiffens as its curling across the width is hindered: see `cfmkit.elastica.mechanics.wide_strip`.
    """

    youngs_modulus: float  # [Pa]
    width: float  # out of the plane [m]
    thickness: float | Taper  # in the plane [m]
    axial: bool = True  # whether the beam stretches
    shear: bool = False  # whether it shears
    poisson_ratio: float = 0.3  # for the shear modulus [1]
    shear_factor: float = 5.0 / 6.0  # share of the area that carries shear [1]; 5/6 for a rectangle
    wide: bool = False

    def __post_init__(self) -> None:
        _require_positive("youngs_modulus", self.youngs_modulus)
        _require_positive("width", self.width)
        _require_positive("shear_factor", self.shear_factor)
        if not isinstance(self.thickness, Taper):
            _require_positive("thickness", self.thickness)
        if not -1 < self.poisson_ratio.real < 0.5 + 1e-12:
            raise InputError(f"poisson_ratio must be between -1 and 0.5, got {self.poisson_ratio}")

    @property
    def stations(self) -> FloatArray:
        """Places where the thickness has a kink or a step, ends included (fractions of the arc length)."""
        if isinstance(self.thickness, Taper):
            return read_only(distinct(self.thickness.stations.real))
        return read_only([0.0, 1.0])

    @property
    def thinnest(self) -> float:
        """Smallest thickness along the beam [m]."""
        thickness: Any = self.thickness
        return float(np.min(thickness.values.real) if isinstance(thickness, Taper) else thickness.real)

    def thickness_at(self, place: Any, inside: float) -> Any:
        """Return the thickness [m] at places on the piece that holds `inside` (fractions of the arc length)."""
        if isinstance(self.thickness, Taper):
            return self.thickness.interpolate(place, inside)
        return self.thickness + 0.0 * place

    def rigidities(self, place: Any, inside: float) -> tuple[Any, Any, Any]:
        """Return EI [N m2] and the compliances 1/EA, 1/(GA) [1/N] at places; a compliance left out is zero.

        Examples
        --------
        >>> bending, axial, shear = Section(2e9, 10e-3, 1e-3, axial=False).rigidities(np.array([0.5]), 0.5)
        >>> float(bending[0].round(9)), float(axial[0]), float(shear[0])
        (0.001666667, 0.0, 0.0)
        """
        t = self.thickness_at(place, inside)
        area = self.width * t
        bending = self.youngs_modulus * area * t * t / 12
        axial = (1.0 if self.axial else 0.0) / (self.youngs_modulus * area)
        modulus = self.shear_factor * self.youngs_modulus / (2 * (1 + self.poisson_ratio))
        shear = (1.0 if self.shear else 0.0) / (modulus * area)
        return bending, axial, shear

    def curling(self, thickness: Any) -> tuple[Any, Any]:
        """Return the `curling_coefficients`; zeros unless it is wide."""
        return curling_coefficients(self.width, thickness, self.poisson_ratio) if self.wide else (0.0 * thickness, 0.0)


def curling_coefficients(width: Any, thickness: Any, poisson_ratio: Any) -> tuple[Any, Any]:
    """Return 3 (1 - nu^2) b^4/t^2 [m2] and nu^2/(1 - nu^2) of a wide strip, b wide and t thick.

    The law is that of `cfmkit.elastica.mechanics.wide_strip`.
    """
    plane = 1 - poisson_ratio**2
    return 3 * plane * (width**2 / thickness) ** 2, poisson_ratio**2 / plane


def hindered_share(width: Any, thickness: Any, poisson_ratio: Any, curvature: Any) -> Any:
    """Return by what share hindered curling raises the energy of a strip that is bent to half a sine, or more.

    Parameters
    ----------
    width, thickness : float or array
        [m].
    poisson_ratio : float
        [1].
    curvature : float or array
        The largest, of a strip that was straight [1/m].

    Returns
    -------
    float or array
        Of the shape that the values broadcast to [1].

    Examples
    --------
    >>> round(float(hindered_share(10e-3, 1e-3, 0.35, 60.0)), 4)
    0.0342
    """
    bent = np.sin(np.pi * (np.arange(_N_SINE_SAMPLES) + 0.5) / _N_SINE_SAMPLES) ** 2
    curl, plate = curling_coefficients(width, thickness, poisson_ratio)
    return plate * (curl_hindered(np.multiply.outer(curl * curvature**2, bent)) @ bent) / bent.sum()


def curl_hindered(z: Any) -> Any:
    """Return the share 1 - g of its curling that a wide strip cannot do, 0 to 1, at z = th^4 (an array).

    The function g and its argument: `cfmkit.elastica.mechanics.wide_strip`, which has the law for the compiled code.

    Examples
    --------
    >>> curl_hindered(np.array([0.0, 180.0, 1e8])).round(3).tolist()
    [0.0, 0.414, 0.98]
    """
    th = np.sqrt(np.sqrt(np.maximum(z, 1e-4)))  # below: th^4/180, less than rounding of the closed form is worth
    e = np.exp(-th)
    g = 2 / th * (1 - 2 * e * np.cos(th) + e * e) / (1 + 2 * e * np.sin(th) - e * e)
    return np.where(z < 1e-4, z / 180, 1 - g)


def _require_positive(name: str, value: Any) -> None:
    if not (0 < value.real < inf and abs(value.imag) < inf):
        raise InputError(f"{name} must be positive, got {value}")
