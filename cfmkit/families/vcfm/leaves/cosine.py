"""The cosine arch: a leaf made as half a cosine wave, y = h (1 - cos(pi x/X))/2, between the wall and the shuttle.

Shallow-arch theory in closed form. With the axial force P = z 4 E I/S^2 (S the leaf's length), the deflected line is
that of a beam-column; what it is shortened by gives z, and the force is the constant of its equation, P times the
slope that rides on the buckling waves. At z = pi^2 the next mode of the constrained arch appears, and from there on the
force is the straight line P_cr (4 h/3 - d)/X: 64 pi^2 (4/3 - D) for the pair in units of E I h/(2X)^3.

[Q] J. Qiu, J. Lang, A. Slocum, J. Microelectromech. Syst. 13 (2004) 137.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.families.vcfm.leaves.kinds import LeafKind, LeafLaw, ProposedStructure
from cfmkit.families.vcfm.leaves.s_form import BUCKLING_LOAD, N_LINE_POINTS, POLE_LOAD, line_between

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray


_MAX_TENSION = 1e5  # tension down to z = -1e5: strains beyond anything that bends
_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(24)
_POSITIVE_NODES, _POSITIVE_WEIGHTS = _GAUSS_NODES[12:], _GAUSS_WEIGHTS[12:]  # what is integrated is even
_ROUNDING_ERROR = 4.0 * float(np.finfo(float).eps)
_BRACKET_PLACES = np.linspace(-1.0, 1.0, 41)
N_EDGE_POINTS = 201  # points of the unloaded centre line, from which edges are drawn


@dataclass(frozen=True)
class CosineLeaf(LeafLaw):
    """The law of one half of a cosine arch, of the same wall, shuttle, thickness and width as the straight leaf.

    Bending is scaled so that the load of the constrained mode is P_cr with stretching and shear, and lengths along the
    arch are developed ones: at 7 deg the negative stiffness is then within 0.6 % of the exact one (2.4 % without).
    """

    @cached_property
    def developed(self) -> Any:
        """Length of the unloaded leaf [m]."""
        slope = 0.25 * np.pi * self.strip.rise / self.strip.reach
        return self.strip.reach * (1.0 + slope**2 - 0.75 * slope**4)

    @cached_property
    def critical_force(self) -> Any:
        """P_cr of the mode that the guided shuttle leaves [N]."""
        euler = 4.0 * np.pi**2 * self.strip.bending / self.developed**2
        return euler * (1.0 + euler / self.strip.axial - euler / self.strip.shear)

    @property
    def balance(self) -> Any:
        """Travel at which the arch carries nothing [m]: a third of the rise beyond its wall."""
        return 4.0 / 3.0 * self.strip.rise

    @cached_property
    def negative_stiffness(self) -> Any:
        """Size of the negative stiffness of one leaf [N/m]: of the buckled form, else of the steepest fall."""
        if np.isfinite(self.linear_range[0]):
            return self.critical_force / self.strip.reach
        return super().negative_stiffness

    @cached_property
    def linear_range(self) -> tuple[Any, Any]:
        """Travels between which the arch is buckled and its force is linear, (from, to) [m]; NaN if it never is.

        The shortening under the buckling load is quadratic in the travel: these are the roots of that equation.
        """
        rise = float(self.strip.rise)
        constant, by_drop, by_square = (float(item[0]) for item in self._quadratic(np.array([BUCKLING_LOAD])))
        drops = np.roots([by_square, by_drop, constant - self._stretch * BUCKLING_LOAD])
        if np.iscomplex(drops).any():
            return np.nan, np.nan
        first, last = sorted(rise - drops.real)
        return float(first), float(last)

    @property
    def _stretch(self) -> Any:
        """Shortening by the axial force, per z."""
        return self.critical_force / (BUCKLING_LOAD * self.strip.axial)

    def force(self, travel: Any) -> FloatArray:
        """Return the force of one leaf along the motion [N], on the stable branch."""
        travel = np.asarray(travel, dtype=float)
        line = self.critical_force * (self.balance - travel) / self.strip.reach
        z = self.root(travel)
        q, _, _, g = self.waves(z, travel)
        slope = np.real(g * np.cos(q))
        bent = self.critical_force * z / BUCKLING_LOAD * slope * self.developed / self.strip.reach
        return np.asarray(np.where(z >= BUCKLING_LOAD, line, bent))

    def stress(self, travel: Any) -> FloatArray:
        """Return the largest stress of the arch, bending and axial [Pa]."""
        travel = np.asarray(travel, dtype=float)
        z = self.root(travel)
        curvature = np.where(z >= BUCKLING_LOAD, self._buckled_curvature(travel), self._bent_curvature(z, travel))
        axial = np.abs(self.critical_force * np.minimum(z, BUCKLING_LOAD) / BUCKLING_LOAD) / self.strip.area
        return np.asarray(0.5 * self.strip.youngs_modulus * self.strip.thickness * curvature + axial)

    def waves(self, z: FloatArray, travel: FloatArray) -> tuple[Any, Any, Any, Any]:
        """Return q, k, the amplitude c of the shape's own wave and that of the other, g; complex in tension."""
        q = np.sqrt(np.asarray(z, dtype=complex))
        q = np.where(np.abs(q - 0.5 * np.pi) < 1e-6, 0.5 * np.pi + 1e-6, np.where(np.abs(q) < 1e-4, 1e-4, q))
        k = 2.0 * q / self.developed
        c = 0.5 * self.strip.rise * np.pi**2 / (4.0 * q * q - np.pi**2)
        g = 0.5 * k * (self.strip.rise - travel + 2.0 * c) / (q * np.cos(q) - np.sin(q))
        return q, k, c, g

    def _quadratic(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients of the shortening in the drop h - d still to go, by Gauss's quadrature.

        Cosines of `waves` in real numbers, which is what takes the time: hyperbolic ones in tension.
        """
        q = np.sqrt(np.abs(z))
        tense = (z < 0) & (q >= 1e-4)
        q = np.where(~tense & (np.abs(q - 0.5 * np.pi) < 1e-6), 0.5 * np.pi + 1e-6, np.where(q < 1e-4, 1e-4, q))
        c = 0.5 * self.strip.rise * np.pi**2 / (np.where(tense, -4.0, 4.0) * q * q - np.pi**2)
        along = q[..., None] * _POSITIVE_NODES
        with np.errstate(all="ignore"):
            cosines = np.cos(along)
            np.cosh(along, out=cosines, where=tense[..., None])
            end, across = np.where(tense, np.cosh(q), np.cos(q)), np.where(tense, np.sinh(q), np.sin(q))
            wave = (q / self.developed / (q * end - across))[..., None] * (end[..., None] - cosines)
        still = c[..., None] * (2.0 * wave - self._own)
        made = (0.5 * self.strip.rise * self._own) ** 2
        return tuple(0.5 * item @ _POSITIVE_WEIGHTS for item in (made - still**2, -2.0 * still * wave, -(wave**2)))

    @cached_property
    def _own(self) -> FloatArray:
        """Slope of the unloaded shape over half its rise, at the places of the quadrature [1/m]."""
        return np.asarray(np.pi / self.developed * np.cos(0.5 * np.pi * _POSITIVE_NODES))

    @cached_property
    def _table(self) -> tuple[FloatArray, tuple[FloatArray, ...]]:
        """Loads z from strong tension up to the pole, and the shortening's coefficients there."""
        z = POLE_LOAD - np.geomspace(_MAX_TENSION, 1e-10, 4000)
        return z, self._quadratic(z)

    def root(self, travel: FloatArray) -> FloatArray:
        """Return z at each travel: the shortening falls as the load grows, so there is one.

        Found in a table by bisection, then refined between its neighbours by secants.
        """
        drop, (table, coefficients_of_rows) = self.strip.rise - np.asarray(travel, dtype=float), self._table

        def excess(z: FloatArray, coefficients: tuple[FloatArray, ...]) -> FloatArray:
            constant, by_drop, by_square = coefficients
            return np.asarray(self._stretch * z - constant - drop * (by_drop + drop * by_square))

        low, high = np.zeros(drop.shape, dtype=int), np.full(drop.shape, len(table) - 1)
        while (high - low > 1).any():
            middle = (low + high) // 2
            over = excess(table[middle], tuple(item[middle] for item in coefficients_of_rows)) > 0
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        before, z = table[low], table[high]
        size_before, size = (excess(table[at], tuple(item[at] for item in coefficients_of_rows)) for at in (low, high))
        for _ in range(6):
            with np.errstate(all="ignore"):
                step = size * (z - before) / (size - size_before)
            before, size_before = z, size
            z = np.clip(z - np.where(np.isfinite(step), step, 0.0), table[low], table[high])
            if (np.abs(z - before) <= _ROUNDING_ERROR * np.abs(z)).all():
                break
            size = excess(z, self._quadratic(z))
        return np.asarray(z)

    def _bent_curvature(self, z: FloatArray, travel: FloatArray) -> FloatArray:
        q, k, c, g = (item[..., None] for item in self.waves(np.minimum(z, POLE_LOAD - 0.1), travel))
        wave = (np.pi / self.developed) ** 2 * np.cos(0.5 * np.pi * (1.0 + _BRACKET_PLACES))
        bend = np.real(-(c + 0.5 * self.strip.rise) * wave + g * k * np.sin(q * _BRACKET_PLACES))
        return np.asarray(np.abs(bend).max(axis=-1))

    def buckled_amplitude(self, travel: FloatArray) -> FloatArray:
        """Return the slope of the free buckling wave [rad]: what the rest of the shape leaves of the shortening."""
        length, rise = self.developed, self.strip.rise
        a, c = np.pi / length, rise / 6.0
        slope = (self.balance - travel) / length
        spent = 0.125 * (a * rise) ** 2 - 2.0 * self.critical_force / self.strip.axial
        square = 2.0 * (spent - 0.5 * (a * c) ** 2 - 1.5 * slope**2 + 16.0 / 3.0 * c * slope / length)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))

    def _buckled_curvature(self, travel: FloatArray) -> FloatArray:
        length, rise = self.developed, self.strip.rise
        a, c = np.pi / length, rise / 6.0
        slope, phase = (self.balance - travel) / length, np.pi * (1.0 + _BRACKET_PLACES)
        free = self.buckled_amplitude(travel)[..., None] * np.cos(phase)
        drawn_curvature = -(c + 0.5 * rise) * a * a * np.cos(0.5 * phase) + 2.0 * a * slope[..., None] * np.sin(phase)
        both = (np.abs(drawn_curvature + sign * 2.0 * a * free).max(axis=-1) for sign in (1.0, -1.0))
        return np.asarray(np.maximum(*both))

    # --- shape ------------------------------------------------------------------------------------------------------

    @property
    def centre_line(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """x, y [m] and slope, unloaded, from the shuttle at (0, 0) to the wall."""
        reach, rise = float(self.strip.reach), float(self.strip.rise)
        x = np.linspace(0.0, reach, N_EDGE_POINTS)
        wave = np.pi * x / reach
        return x, -0.5 * rise * (1.0 - np.cos(wave)), -0.5 * np.pi * rise / reach * np.sin(wave)

    def beam_shapes(self) -> tuple[Any, Any]:
        """Return the shapes of `cfmkit.elastica` of an arch from wall to shuttle, and of its mirror image."""
        from cfmkit.elastica import CosineArch

        return CosineArch(self.strip.rise, 0.5), CosineArch(-self.strip.rise, 0.5)

    def bent_line(self, travel: float) -> FloatArray:
        """Return the centre line at a travel, from the wall at (0, 0) to the shuttle, (n, 2) [m]."""
        at = np.array([travel])
        z, length, rise = float(self.root(at)[0]), float(self.developed), float(self.strip.rise)
        eta = np.linspace(-1.0, 1.0, N_LINE_POINTS)
        drawn_slope = np.pi / length * np.cos(0.5 * np.pi * eta)
        if z >= BUCKLING_LOAD:
            slope = (float(self.balance) - travel) / length
            free = float(self.buckled_amplitude(at)[0])
            phase = np.pi * (1.0 + eta)
            turn = -rise / 6.0 * drawn_slope + slope * (1.0 - np.cos(phase)) + free * np.sin(phase)
        else:
            q, _, c, g = (
                complex(item[0]) if np.ndim(item) else complex(item) for item in self.waves(np.array([z]), at)
            )
            turn = np.real(-c * drawn_slope + g * (np.cos(q) - np.cos(q * eta)))
        end = (float(self.strip.reach), rise - travel)
        return line_between(np.arctan(turn), np.full(N_LINE_POINTS, length / (N_LINE_POINTS - 1)), end)


COSINE_LEAF = LeafKind(
    "cosine",
    "half cosine arches",
    lambda strip, _keys: CosineLeaf(strip),
    proposal=ProposedStructure("cosine arches", "2 cosine arches", 3, lambda _leaf: {"structure": "cosine"}),
)
