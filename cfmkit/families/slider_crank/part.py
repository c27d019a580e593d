"""Geometry of a slider-crank over its motion: a printed part, or links and pins with their springs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.export.contours import OUTLINE_TOLERANCE
from cfmkit.export.posed_part import PosedBody
from cfmkit.families.base import function_named
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.outline import drawing

if TYPE_CHECKING:
    from cfmkit.export.posed_part import PosedPart
    from cfmkit.results import Result


def part_over_motion(result: Result) -> PosedPart | None:
    """Return a solved mechanism over its motion along the slider's path; None if nothing was solved.

    A printed part counts as it is cut, too: a mirrored pair is drawn apart from each other, and so needs a little less
    than is said. One that was solved as a solid moves as its beams do, to a fraction of a thickness.
    """
    spec: Any = result.spec
    if result.state is not None and spec.fidelity == "solid":
        from cfmkit.families.slider_crank.printed.model import analyze

        result = analyze(spec.replace({"analysis.fidelity": spec.piece, "requirements": ()}), Run())
    if result.state is None:
        return None
    spec = result.spec
    found: PosedPart = function_named(f"cfmkit.families.slider_crank.{spec.built_as}.part:part_over_motion")(result)
    if spec.built_as == "springs":
        return found
    cut = (one for one in drawing(spec).contours if one.layer == "cut" and not one.hole)
    as_cut = (PosedBody.polygon("as cut", "free", one.points(OUTLINE_TOLERANCE)) for one in cut)
    return replace(found, bodies=(*as_cut, *found.bodies))
