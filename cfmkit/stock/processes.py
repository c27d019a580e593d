"""Processes that mechanisms are made by, how far parts are off, and strands and layers of printed parts.

How far parts are off is assumed, each value with its reason. No standard or machine stands behind these numbers: they
are what a good workshop is assumed to hold on parts of some centimetres, for a first look at how many parts would be
good. Measure some parts and give `design.tolerances` instead.

A printed part has strands of a nozzle beside each other, and layers on each other. Along its layers it bears more than
across them. A wall is a whole number of strands: between two whole numbers a slicer leaves a gap, or presses strands
together, and the wall is not what was analysed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

from cfmkit.stock.materials import MATERIALS_BY_NAME

if TYPE_CHECKING:
    from collections.abc import Mapping


Layers = Literal["along", "across"]
"""Whether what bends is stressed along the layers of the print (it lies flat), or across them (it stands)."""

WHOLE_SHARE = 0.02  # part of a strand within which a thickness counts as a whole number of them


@dataclass(frozen=True)
class LayeredStrength:
    """Strength of a printed material along its layers and between them."""

    along: float  # [Pa]
    across: float  # [Pa]
    modulus_across: float | None  # [Pa]; None if no source gives one
    source: str


LAYER_STRENGTHS: Mapping[str, LayeredStrength] = MappingProxyType(
    {
        "pla": LayeredStrength(
            45e6, 12e6, 1.6e9,
            "along: Stratasys PLA, ASTM D638, on edge (flat: 26 MPa); across: PolyTerra PLA data sheet V5.3, ISO 527",
        ),
        "petg": LayeredStrength(
            45e6, 25e6, None, "additive.tools/materials/petg: 44 to 56 MPa along, 25 to 38 MPa between the layers"
        ),
    }
)  # fmt: skip
"""By the name of the material; the others have no source that tells both."""


def strands(thickness: float, nozzle: float) -> tuple[int, ...]:
    """Return the whole numbers of strands next to a thickness [m], the nearest first; one if it is whole already.

    Examples
    --------
    >>> strands(0.96e-3, 0.4e-3), strands(1.2e-3, 0.4e-3), strands(0.1e-3, 0.4e-3)
    ((2, 3), (3,), (1,))
    """
    share = thickness / nozzle
    nearest = max(1, round(share))
    if abs(share - nearest) <= WHOLE_SHARE or share < 1.0:
        return (nearest,)
    return (nearest, nearest + (1 if share > nearest else -1))


def is_whole(thickness: float, nozzle: float) -> bool:
    """Return True if a thickness [m] is a whole number of strands."""
    share = thickness / nozzle
    return share > 0.5 and abs(share - round(share)) <= WHOLE_SHARE


def strands_in_words(thickness: float, nozzle: float) -> str:
    """Return how many strands a thickness is, and what would be whole numbers of them.

    Examples
    --------
    >>> strands_in_words(0.96e-3, 0.4e-3)
    '0.96 mm are 2.4 strands of 0.4 mm: whole ones are 0.8 mm (2) or 1.2 mm (3)'
    >>> strands_in_words(1.2e-3, 0.4e-3)
    '1.2 mm are 3 strands of 0.4 mm'
    """
    millimetres, share = 1e3 * thickness, thickness / nozzle
    if is_whole(thickness, nozzle):
        return f"{millimetres:.6g} mm are {round(share)} strand{'s' if round(share) > 1 else ''} of {1e3 * nozzle:g} mm"
    neighbours = sorted(strands(thickness, nozzle))
    whole = " or ".join(f"{1e3 * nozzle * number:.6g} mm ({number})" for number in neighbours)
    rounded = math.floor(100.0 * share + 0.5) / 100.0
    return f"{millimetres:.6g} mm are {rounded:g} strands of {1e3 * nozzle:g} mm: whole ones are {whole}"


ProcessName = Literal["laser", "wire-edm", "fdm", "sls", "mill"]


@dataclass(frozen=True)
class ProcessAccuracy:
    """Accuracy that is assumed of a process."""

    name: ProcessName  # how a specification calls it
    kerf: float  # width of the cut; 0 where nothing is cut [m]
    # standard deviation of the thickness of a leaf between its two sides, the same all over a part [m]
    thickness: float
    position: float  # standard deviation of where a joint or an end lies [m]
    # least_feature, least_radius: thinnest wall, and smallest inside radius [m]
    least_feature: float
    least_radius: float
    reason: str  # why these


_PROCESS_LIST = (
    ProcessAccuracy("laser", 0.2e-3, 0.03e-3, 0.05e-3, 0.5e-3, 0.1e-3,
            "a leaf has two cut sides, and the kerf changes with focus, power and sheet"),
    ProcessAccuracy("wire-edm", 0.3e-3, 0.005e-3, 0.005e-3, 0.2e-3, 0.15e-3,
            "the gap follows the generator; inside corners have the radius of a 0.25 mm wire and its gap"),
    ProcessAccuracy("fdm", 0.0, 0.05e-3, 0.1e-3, 0.4e-3, 0.2e-3,
            "walls are whole strands of a 0.4 mm nozzle, whose width changes with flow and cooling"),
    ProcessAccuracy("sls", 0.0, 0.05e-3, 0.1e-3, 0.7e-3, 0.3e-3,
            "powder sinters on to each side, and the shrinkage of parts depends on their place in the chamber"),
    ProcessAccuracy("mill", 2.0e-3, 0.02e-3, 0.02e-3, 0.5e-3, 1.0e-3,
            "a thin leaf yields to the cutter; inside corners have the radius of a 2 mm one"),
)  # fmt: skip
PROCESSES_BY_NAME: Mapping[str, ProcessAccuracy] = MappingProxyType(
    {process.name: process for process in _PROCESS_LIST}
)
"""All by name."""
SPRING_RATE = 0.05
"""Half width of the range in which the rate of a spring is found, over its nominal rate: all values are equally likely.

Assumed for custom springs, helical and torsion: EN 15800 (which replaced DIN 2095) gives the loads of cold
coiled springs in grade 2, the usual one, tolerances of this size; it is written for compression springs. Stock springs
are wider: Lee Spring states 10 % of the rate.
"""
PROCESS_BY_PLASTIC = {"pla": "fdm", "abs": "fdm", "petg": "fdm", "pa12-sls": "sls", "pa12-mjf": "sls"}
MIN_METAL_MODULUS = 20e9
"""Young's modulus above which a material is taken for a metal [Pa]: no plastic reaches it, no metal is as soft."""
POWDER_MATERIALS = ("pa12-sls", "pa12-mjf")  # materials whose values are those of sintered powder
RUBBER_MATERIALS = ("tpu-95a",)  # materials that yield to a cutter


def why_not_made(process: str, material: str | None, youngs_modulus: float) -> str:
    """Return why a process makes no part of a material, and which processes do; empty if it does.

    Wires erode what conducts, which is metals; nozzles and powder beds make plastics. A powder with values of its own
    is sintered only, and filaments are not.

    Examples
    --------
    >>> why_not_made("fdm", "titanium-6al-4v", 114e9)
    'titanium-6al-4v is not made by fdm, but by laser, wire-edm or mill'
    >>> why_not_made("fdm", "pla", 3e9)
    ''
    """
    made_by = _processes_of(material, youngs_modulus)
    if process in made_by:
        return ""
    *others, last = made_by
    name = material or ("this metal" if youngs_modulus > MIN_METAL_MODULUS else "this plastic")
    return f"{name} is not made by {process}, but by {', '.join(others)}{' or ' if others else ''}{last}"


def finest_process(material: str | None, youngs_modulus: float) -> ProcessAccuracy:
    """Return the process with the thinnest wall of those that make parts of a material.

    Examples
    --------
    >>> finest_process("titanium-6al-4v", 114e9).name, finest_process("pla", 3e9).name
    ('wire-edm', 'fdm')
    """
    made_by = (PROCESSES_BY_NAME[name] for name in _processes_of(material, youngs_modulus))
    return min(made_by, key=lambda process: process.least_feature)


def _processes_of(material: str | None, youngs_modulus: float) -> tuple[str, ...]:
    """Return by which processes parts of a material are made."""
    if youngs_modulus > MIN_METAL_MODULUS:
        return ("laser", "wire-edm", "mill")
    if material in POWDER_MATERIALS:
        return ("sls",)
    if material in RUBBER_MATERIALS:
        return ("laser", "fdm")
    # a material of one's own may be a powder, too
    return ("laser", "fdm", "mill") if material in MATERIALS_BY_NAME else ("laser", "fdm", "sls", "mill")


def usual_process(material: str | None, youngs_modulus: float) -> ProcessAccuracy:
    """Return the process that a material is usually made by: what it was named for, else wire for metals, else laser.

    Examples
    --------
    >>> usual_process("pla", 3e9).name, usual_process(None, 200e9).name, usual_process(None, 2e9).name
    ('fdm', 'wire-edm', 'laser')
    """
    name = PROCESS_BY_PLASTIC.get(material or "", "wire-edm" if youngs_modulus > MIN_METAL_MODULUS else "laser")
    return PROCESSES_BY_NAME[name]
