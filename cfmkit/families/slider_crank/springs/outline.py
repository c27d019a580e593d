"""The parts of a slider-crank with springs: two links with pin holes, eyes around the pins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.export.contours import Arc, Contour, Drawing, DrawnDimension, Line, Sheet, circle
from cfmkit.families.slider_crank.linkage import linkage_of
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES
from cfmkit.specs.units import format_short
from cfmkit.stock.stock_series import hole_with_fit, series_of

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import SliderCrankSpec


SHEET_KEY = "mechanism.part.sheet"
"""Says how thick the links are: without springs that are part of them, they have no width."""
EYE_SHARE, HOLE_SHARE = 0.08, 0.04
"""Radii of eyes, which are half as wide as links, and of pin holes in lengths of the shorter link, where no pins are
stated."""
PIN_IN_COIL = 0.8
"""Diameter of a pin that is not stated over the inside of the relaxed spring around it: wound up that is narrower."""
EYE_OF_HOLE = 2.0  # least radius of an eye in those of its hole: a wall as thick as the hole's radius


def pin_within(largest: float) -> float:
    """Return the thickest pin that is sold up to a diameter [m], or that diameter where all are thicker."""
    series = series_of("pin", "metric")
    return max((size for size in series.sizes if size <= largest), default=largest) if series else largest


def eye_and_hole(spec: SliderCrankSpec) -> tuple[float, float]:
    """Return the radii of the links' eyes, half their width, and of their pin holes [m]."""
    linkage = linkage_of(spec.mechanism)
    short = min(linkage.crank, linkage.coupler)
    pins, links = spec.mechanism.pins, spec.mechanism.links
    coils = [coil for name in JOINT_NAMES[:3] for coil in spec.mechanism.springs.coils_at(name)]
    around = min((0.5 * PIN_IN_COIL * coil.inner_diameter for coil in coils), default=short)
    hole = 0.5 * (pin_within(2.0 * min(HOLE_SHARE * short, around)) if pins is None else pins.diameter)
    if links is not None:
        return 0.5 * links.width, 0.5 * pin_within(min(2.0 * hole, 0.5 * links.width)) if pins is None else hole
    return max(EYE_SHARE * short, EYE_OF_HOLE * hole), hole


def drawing(spec: SliderCrankSpec) -> Drawing:
    """Return crank and coupler of one leg, with a hole for each pin, beside each other."""
    linkage = linkage_of(spec.mechanism)
    eye, hole = eye_and_hole(spec)
    contours: list[Contour] = []
    for number, length in enumerate((linkage.crank, linkage.coupler)):
        y = -3.0 * eye * number
        edges = (
            Line((0.0, y - eye), (length, y - eye)),
            Arc((length, y), eye, -0.5 * np.pi, 0.5 * np.pi),
            Line((length, y + eye), (0.0, y + eye)),
            Arc((0.0, y), eye, 0.5 * np.pi, 1.5 * np.pi),
        )
        contours.append(Contour(edges, "cut", closed=True))
        contours += [circle((x, y), hole, "cut", hole=True) for x in (0.0, length)]
    part = spec.mechanism.part
    y = -3.0 * eye
    reported = (
        DrawnDimension("crank", (0.0, 0.0), (linkage.crank, 0.0)),
        DrawnDimension("coupler", (0.0, y), (linkage.coupler, y)),
    )
    material = spec.mechanism.material
    facts = [("material", "not stated" if material is None else material.words)]
    facts += [("pin holes", f"diameter {hole_with_fit(2.0 * hole, 8)}, pins h8")]
    facts += [("links", f"{format_short(2.0 * eye, 'length')} wide, ends round")]
    facts += [("offset", format_short(linkage.offset, "length"))] if linkage.offset else []
    sheet = Sheet(part.sheet if part else None, (), SHEET_KEY)
    return Drawing("slider-crank", tuple(contours), sheet=sheet, dimensions=reported, facts=tuple(facts))
