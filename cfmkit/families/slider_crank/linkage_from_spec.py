"""From a specification to the linkage that springs and printed parts have in common.

Reference
---------
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from cfmkit.families.findings import deg, mm
from cfmkit.families.rows import with_values
from cfmkit.families.slider_crank.findings import finding
from cfmkit.families.slider_crank.linkage import Linkage

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.spec import Mechanism, SliderCrankSpec


def resolve(spec: SliderCrankSpec) -> SliderCrankSpec:
    """Return the spec with the coupler written out: from now on it is a fixed part."""
    mechanism = spec.mechanism
    if mechanism.stretched_position is None:
        return spec
    written = {"mechanism.coupler_length": coupler_length(mechanism), "mechanism.stretched_position": None}
    return with_values(spec, written)


def coupler_length(mechanism: Mechanism) -> float:
    """Return r2 [m], from the stretched position where it is not given [B, eq. 11]."""
    if mechanism.coupler_length is not None:
        return mechanism.coupler_length
    reach = math.hypot(mechanism.stretched_position or 0.0, mechanism.offset)
    if reach <= mechanism.crank_length:
        raise finding.cannot_build(
            "not_assemblable",
            f"pivot and slider pin are {mm(reach)} apart when stretched, and the crank alone is "
            f"{mm(mechanism.crank_length)}: no length is left for the coupler; make "
            "'mechanism.crank_length' shorter, or 'mechanism.stretched_position' longer",
        )
    return reach - mechanism.crank_length


def linkage_of(mechanism: Mechanism) -> Linkage:
    """Return the linkage of a mechanism.

    Raises CannotBuild if crank and coupler do not reach the slider's path.
    """
    branch = 1 if mechanism.branch == "right" else -1
    linkage = Linkage(mechanism.crank_length, coupler_length(mechanism), mechanism.offset, branch)
    if not linkage.assemblable:
        raise finding.cannot_build(
            "not_assemblable",
            f"crank and coupler together are {mm(linkage.crank + linkage.coupler)}, but the slider's path passes "
            f"the pivot at {mm(abs(linkage.offset))}; make the links longer or the "
            "offset smaller: 'mechanism.coupler_length' or 'mechanism.offset'",
        )
    return linkage


def unloaded_angle(mechanism: Mechanism, linkage: Linkage) -> float:
    """Return the crank angle with all springs relaxed [rad].

    Raises CannotBuild if the linkage does not reach it.
    """
    given = mechanism.unloaded_angle
    angle = given if given is not None else linkage.stretched_angle + (mechanism.unloaded_offset or 0.0)
    if not linkage.reaches(angle):
        low, high = linkage.arc(linkage.stretched_angle)
        raise finding.cannot_build(
            "not_assemblable",
            f"with the crank at {deg(angle)} the coupler of {mm(linkage.coupler)} does not reach the slider's "
            f"path; 'mechanism.unloaded_angle' must be between {deg(low)} and {deg(high)}",
        )
    return angle


def side_of(spec: SliderCrankSpec, linkage: Linkage, unloaded: float) -> int:
    """Return 1 for a crank that is beyond the stretched position when a force drives, -1 for one before it."""
    if spec.analysis.side is not None:
        beyond = 1 if spec.analysis.side == "beyond" else -1
    else:
        beyond = -1 if linkage.knee(unloaded) < 0 else 1
    return beyond
