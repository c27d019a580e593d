"""The nearly straight chain of a slider-crank as a beam network: lumped flexures between rigid links, or one strip.

The chain begins clamped to the ground at the far end of the pivot's flexure and ends in the slider, which
moves along its way without turning. Each flexure is straight between its ends; the one at the crank pin is the
chord across the small kink [B, sec. 2.2].

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.arrays import read_only
from cfmkit.elastica import (
    CLAMPED_SUPPORT,
    FREE_SUPPORT,
    Beam,
    Link,
    Network,
    Node,
    Polyline,
    Section,
    Support,
    Taper,
    slider_support,
)
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.linkage import Linkage


@dataclass(frozen=True)
class Flexure:
    """A flexure with a rectangular section, lying across a joint."""

    # length, thickness, width: along the link, in the plane of bending, out of it [m]
    length: float
    thickness: float
    width: float
    before: float = 0.5  # share of the length that lies before the joint

    def rate(self, youngs_modulus: float) -> float:
        """Return the rate as a torsion spring [N m/rad] [B, eq. 12].

        Examples
        --------
        >>> round(Flexure(10.8e-3, 0.908e-3, 2.478e-3).rate(1.8e9) * 1e3, 6)
        25.764775
        """
        return youngs_modulus * self.width * self.thickness**3 / (12.0 * self.length)

    def rotation(self, youngs_modulus: float, stress: float) -> float:
        """Return the rotation at which pure bending reaches a stress [rad]."""
        return 2.0 * stress * self.length / (youngs_modulus * self.thickness)


SLIDER_NODE = "slider"  # name of the node that moves along the way
FLEXURE_BEAMS = ("pivot", "crank_pin", "slider_pin")
STRIP_BEAM = "strip"  # names of the beams


@dataclass(frozen=True)
class Elasticity:
    """Material of the part: modulus [Pa], Poisson ratio, largest stress allowed [Pa] (None: no limit).

    `wide`: whether wide sections stiffen as their curling across the width is hindered.
    """

    youngs_modulus: float
    poisson_ratio: float = 0.35
    allowable_stress: float | None = None
    wide: bool = False

    def section(self, width: Any, thickness: Any) -> Section:
        """Return a rectangle that bends, stretches and shears."""
        return Section(
            self.youngs_modulus, width, thickness, shear=True, poisson_ratio=self.poisson_ratio, wide=self.wide
        )


@dataclass(frozen=True)
class Strip:
    """One strip along a polyline, its thickness linear between places."""

    corners: FloatArray  # (k, 2) centre line before any load, from the clamped end to the slider [m]
    width: Any  # out of the plane [m]
    thickness: Any  # (n,) in the plane [m]; complex where derivatives are taken
    places: FloatArray  # (n,) where, as fractions of the length from 0 to 1

    def __post_init__(self) -> None:
        """Freeze the corners and places."""
        object.__setattr__(self, "corners", read_only(self.corners))
        object.__setattr__(self, "places", read_only(self.places))

    @property
    def length(self) -> float:
        """Length of the centre line [m]."""
        return float(np.hypot(*np.diff(self.corners, axis=0).T).sum())

    def network(self, material: Elasticity) -> Network:
        """Return the strip as a beam network."""
        nodes = {
            "ground": _make_node(self.corners[0], CLAMPED_SUPPORT),
            SLIDER_NODE: _make_node(self.corners[-1], slider_support(0.0)),
        }
        section = material.section(self.width, Taper(self.places, np.asarray(self.thickness)))
        return Network(nodes, {STRIP_BEAM: Beam("ground", SLIDER_NODE, section, Polyline(self.corners))})


def _make_node(place: FloatArray, support: Support) -> Node:
    return Node(float(place[0]), float(place[1]), support)


def joints(linkage: Linkage, unloaded: float) -> FloatArray:
    """Return pivot, crank pin and slider pin in the unloaded position, (3, 2) [m]."""
    pin = linkage.crank * np.array([np.cos(unloaded), np.sin(unloaded)])
    slider = np.array([float(linkage.slider_position(np.array(unloaded))), linkage.offset])
    return np.array([np.zeros(2), pin, slider])


def flexure_ends(
    places: FloatArray,  # (3, 2): the joints [m]
    # lengths, before: length of each flexure [m], and the share of it that lies before its joint
    lengths: Sequence[float],
    before: Sequence[float],
) -> FloatArray:
    """Return the ends of the three flexures, (6, 2) [m]: S1 to S6 of [B, fig. 7].

    Raises InputError if two flexures are together longer than the link between their joints.
    """
    crank, coupler = places[1] - places[0], places[2] - places[1]
    for k, (link, name) in enumerate(((crank, "crank"), (coupler, "coupler"))):
        used = (1.0 - before[k]) * lengths[k] + before[k + 1] * lengths[k + 1]
        if used > np.hypot(*link):
            raise InputError(
                f"the flexures at its ends take {used * 1e3:.4g} mm of the {name}, which has "
                f"{np.hypot(*link) * 1e3:.4g} mm: make them shorter"
            )
    crank, coupler = crank / np.hypot(*crank), coupler / np.hypot(*coupler)
    along = ((crank, crank), (crank, coupler), (coupler, coupler))
    ends = []
    for joint, length, share, (to, away) in zip(places, lengths, before, along, strict=True):
        ends += [joint - share * length * to, joint + (1.0 - share) * length * away]
    return np.array(ends)


def mirror_points(points: FloatArray, places: FloatArray) -> FloatArray:
    """Return points mirrored about the line from the pivot to the slider pin: the chain with its kink the other way."""
    axis = (places[2] - places[0]) / np.hypot(*(places[2] - places[0]))
    relative = points - places[0]
    mirrored: FloatArray = places[0] + 2.0 * np.outer(relative @ axis, axis) - relative
    return mirrored


def flexure_network(ends: FloatArray, flexures: Sequence[Flexure], material: Elasticity) -> Network:
    """Return three flexures and two rigid links as a beam network."""
    names = ("ground", "crank", "crank end", "coupler", "coupler end", SLIDER_NODE)
    supports = {"ground": CLAMPED_SUPPORT, SLIDER_NODE: slider_support(0.0)}
    nodes = {name: _make_node(place, supports.get(name, FREE_SUPPORT)) for name, place in zip(names, ends, strict=True)}
    beams = {
        name: Beam(names[2 * k], names[2 * k + 1], material.section(flexure.width, flexure.thickness))
        for k, (name, flexure) in enumerate(zip(FLEXURE_BEAMS, flexures, strict=True))
    }
    return Network(nodes, beams, links=(Link("crank", "crank end"), Link("coupler", "coupler end")))


def taper_of(section: Section) -> Taper:
    """Return the thickness of a section along its beam; of one thickness both ends."""
    thickness = section.thickness
    return thickness if isinstance(thickness, Taper) else Taper(np.array([0.0, 1.0]), np.repeat(thickness, 2))


def stations(
    corners: FloatArray,  # (k + 1, 2): the polyline [m]
    shares: Sequence[Sequence[float]],  # for every straight piece, shares of its length at which a place lies
) -> FloatArray:
    """Return places along a polyline as fractions of its length, both ends included [B, eq. 13]."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    inner = [starts[k] + share * lengths[k] for k, shares_of_piece in enumerate(shares) for share in shares_of_piece]
    places = np.concatenate([[0.0], np.array(inner) / starts[-1], [1.0]])
    return places


def kink(places: FloatArray) -> float:
    """Return how far the crank pin lies off the line from pivot to slider pin [m]; positive: to its left."""
    (px, py), (qx, qy) = places[1] - places[0], places[2] - places[0]
    return float((qx * py - qy * px) / np.hypot(qx, qy))
