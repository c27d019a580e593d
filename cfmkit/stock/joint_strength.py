"""Strength of what joins a mechanism: links, pins, eyes, plates, guides. Every formula once, for all families.

Nominal stresses of bars and pins, as textbooks have them; concentrations at holes are not counted. Ductile material is
assumed: it yields in shear at 1/sqrt(3) of its yield strength (von Mises).

Reference
---------
[Sh] R. G. Budynas, J. K. Nisbett, Shigley's Mechanical Engineering Design, 9th ed., McGraw-Hill (2011): bending and
    shear of round bars sec. 3-10 and 3-11, Euler's column sec. 4-12, bearing and shear-out of joints sec. 8-12.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np

SHEAR_SHARE = 1.0 / sqrt(3.0)  # yield strength in shear over that in tension (von Mises)


def link_stress(axial: Any, moment: Any, width: Any, thickness: Any, hole: Any) -> Any:
    """Return tension and bending in the section of a bar through a hole in its middle [Pa].

    Parameters
    ----------
    axial, moment : float or array
        Axial force [N] and moment in the plane [N m].
    width, thickness, hole : float or array
        Of the bar, and diameter of the hole [m].

    Examples
    --------
    >>> round(float(link_stress(100.0, 0.0, 0.012, 0.002, 0.002)) / 1e6, 6)  # 100 N on 10 mm x 2 mm
    5.0
    >>> round(float(link_stress(0.0, 0.3, 0.012, 0.003, 0.004)) / 1e6, 3)  # 0.3 N m on (12^3 - 4^3)/12 3/6 mm3
    4.327
    """
    return np.abs(axial) / ((width - hole) * thickness) + 6.0 * width * np.abs(moment) / (
        thickness * (width**3 - hole**3)
    )


def bearing_pressure(force: Any, diameter: Any, thickness: Any) -> Any:
    """Return the pressure of a pin on its hole [Pa].

    >>> round(bearing_pressure(60.0, 0.003, 0.002) / 1e6, 6)
    10.0
    """
    return force / (diameter * thickness)


def shear_out(force: Any, width: Any, thickness: Any, hole: Any) -> Any:
    """Return the shear stress behind a pin, on two planes as long as the wall beside the hole [Pa].

    >>> round(shear_out(60.0, 0.008, 0.002, 0.003) / 1e6, 6)
    6.0
    """
    return force / (thickness * (width - hole))


def euler_load(modulus: Any, width: Any, thickness: Any, length: Any) -> Any:
    """Return the load at which a bar with hinged ends buckles over its thickness [N].

    >>> round(euler_load(210e9, 0.012, 0.002, 0.2), 2)  # pi^2 210e9 8e-12 / 0.04
    414.52
    """
    return pi**2 * modulus * width * thickness**3 / (12.0 * length**2)


def pin_bending(force: Any, arm: Any, diameter: Any) -> Any:
    """Return the bending stress of a pin whose load acts at an arm from where it is held [Pa].

    >>> round(pin_bending(100.0, 0.004, 0.004) / 1e6, 3)  # 32 * 0.4 / (pi 64e-9)
    63.662
    """
    return 32.0 * force * arm / (pi * diameter**3)


def pin_shear(force: Any, diameter: Any) -> Any:
    """Return the largest shear stress of a pin in one section, 4/3 of the mean [Pa].

    >>> round(pin_shear(100.0, 0.004) / 1e6, 3)  # 4/3 * 100 / (pi 4e-6)
    10.61
    """
    return 16.0 * force / (3.0 * pi * diameter**2)


def rod_bending(force: Any, span: Any, diameter: Any) -> Any:
    """Return the bending stress of a rod held at both ends as on hinges, with its load in the middle [Pa].

    >>> round(rod_bending(20.0, 0.1, 0.006) / 1e6, 3)  # 8 * 2 / (pi 216e-9)
    23.579
    """
    return 8.0 * force * span / (pi * diameter**3)


def rod_sag(force: Any, span: Any, diameter: Any, modulus: Any) -> Any:
    """Return how far the middle of such a rod gives way [m].

    >>> round(rod_sag(20.0, 0.1, 0.006, 210e9) * 1e6, 3)  # 20 1e-3 / (48 210e9 63.617e-12) m
    31.189
    """
    return 4.0 * force * span**3 / (3.0 * pi * modulus * diameter**4)


def pin_that_bears(
    force: float, arm: float, thickness: float, allowable: float, pin_allowable: float, diameters: tuple[float, ...]
) -> float | None:
    """Return the thinnest pin of a series that bears its load in its hole, in bending and in shear; None if none does.

    Parameters
    ----------
    force, arm : float
        Load [N], and how far from its support it acts [m].
    thickness, allowable : float
        Of what the pin is in [m], and the stress that this may have [Pa].
    pin_allowable : float
        Stress that the pin may have [Pa].
    diameters : tuple of float
        Of the series, increasing [m].
    """
    return next(
        (
            d
            for d in diameters
            if bearing_pressure(force, d, thickness) <= allowable
            and pin_bending(force, arm, d) <= pin_allowable
            and pin_shear(force, d) <= SHEAR_SHARE * pin_allowable
        ),
        None,
    )


def eye_that_bears(force: float, thickness: float, hole: float, allowable: float, least_wall: float) -> float:
    """Return the width of a bar in tension around a hole that bears its load, and leaves a wall [m].

    >>> round(1e3 * eye_that_bears(1000.0, 0.002, 0.004, 100e6, 0.001), 3)  # shear-out: 4 + 1000 sqrt(3)/(2 100) mm
    12.66
    """
    net = force / (thickness * allowable)
    return hole + max(net, force / (thickness * SHEAR_SHARE * allowable), 2.0 * least_wall)


def rod_that_guides(
    force: float, span: float, modulus: float, allowable: float, sag_share: float, diameters: tuple[float, ...]
) -> float | None:
    """Return the thinnest rod of a series that bears a load in its middle and sags by a share of its span at most."""
    return next(
        (
            d
            for d in diameters
            if rod_bending(force, span, d) <= allowable and rod_sag(force, span, d, modulus) <= sag_share * span
        ),
        None,
    )
