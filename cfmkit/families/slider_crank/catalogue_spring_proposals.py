"""Proposals of slider-cranks for a constant force with catalogue torsion springs at their pins.

The family's own design chooses the springs from those of the generic series that fit beside the links; then links
that bear the loads are added, as for custom springs.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from cfmkit.errors import SolutionError
from cfmkit.families.findings import mm
from cfmkit.families.slider_crank.linkage import linkage_of
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.sprung_linkage_proposals import (
    depth_of_springs,
    pushed_analysis,
    sheets_of_links,
    with_links,
)
from cfmkit.families.slider_crank.unit_springs import JOINT_NAMES
from cfmkit.stock.springs.offers import generic_series
from cfmkit.stock.springs.spec import CatalogueSpring
from cfmkit.stock.springs.torsion_springs import HelicalTorsionSpring

if TYPE_CHECKING:
    from cfmkit.families.proposals import Candidate, Request


def with_catalogue_springs(made: Candidate) -> Candidate:
    """Return the same linkage for a force, to be given springs of the generic series."""
    return replace(made, variant="catalogue springs at pins", finish=finish, springs="catalogue")


def finish(spec: SliderCrankSpec, request: Request) -> SliderCrankSpec:
    """Return a linkage for a force with springs of the generic series, and with the thinnest links that bear them.

    Raises SolutionError if no springs of the series that fit hold the force, or no links bear them.
    """
    from cfmkit.families.run_control import Run
    from cfmkit.families.slider_crank.springs.design import design

    first = float(spec.analysis.window[0])  # type: ignore[index]
    window = first, first + request.travel * (1.0 + 1e-6)
    for sheet in sheets_of_links(request):
        targets = {
            "force": request.target, "travel": window, "springs": JOINT_NAMES[:3],
            "catalogue": _catalogue_springs(spec, request, sheet), "spring_safety": request.safety,
        }  # fmt: skip
        changes = {"design": targets, "analysis": pushed_analysis(window), "mechanism.part.sheet": sheet}
        designed = design(spec.replace(changes), Run())
        if not isinstance(designed.spec, SliderCrankSpec):
            raise SolutionError(designed.message)
        # the rates are those of the wires
        chosen = designed.spec.replace(
            {"design": None, "mechanism.springs": {"bought": designed.spec.mechanism.springs.bought}}
        )
        for block in request.materials or ({"name": "steel-s235"},):
            linked = with_links(chosen, request, block)
            if linked is not None:
                return linked
    raise SolutionError("links neither bear the loads of the springs nor stay straight under them")


def _catalogue_springs(spec: SliderCrankSpec, request: Request, sheet: float) -> list[CatalogueSpring]:
    """Return the springs of the generic series that fit beside links of a sheet [m], half of the room on either side.

    Raises SolutionError if there are none.
    """
    link = linkage_of(spec.mechanism)
    deep, widest = 0.5 * depth_of_springs(request, sheet), min(link.crank, link.coupler)
    listed = []
    for offer in generic_series(HelicalTorsionSpring):
        # wound up by as much as it bears
        long = math.inf if offer.wound is None else offer.wound.room_for(offer.largest or 0.0)
        counts = tuple(count for count in offer.counts if count * long <= deep)
        if counts and (offer.outer_diameter or math.inf) <= widest:
            listed.append(CatalogueSpring.from_offer(replace(offer, counts=counts)))
    if not listed:
        raise SolutionError(f"no spring of the generic series fits at the pins within {mm(deep)} on either side")
    return listed
