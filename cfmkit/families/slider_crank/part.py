"""Geometry of a slider-crank over its motion: a printed part, or links and pins with their springs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cfmkit.export.contours import OUTLINE_TOLERANCE
from cfmkit.export.posed_part import PosedBody
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit.families.run_control import Run
from cfmkit.families.slider_crank.outline import drawing

with deferred_imports():
    from cfmkit.families.slider_crank.printed.model import analyze
    from cfmkit.families.slider_crank.printed.part import part_over_motion as of_printed
    from cfmkit.families.slider_crank.springs.part import part_over_motion as of_springs

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
        result = analyze(spec.replace({"analysis.fidelity": spec.piece, "requirements": ()}), Run())
    if result.state is None:
        return None
    spec = result.spec
    if spec.built_as == "springs":
        return of_springs(result)
    cut = (contour for contour in drawing(spec).contours if contour.layer == "cut" and not contour.hole)
    as_cut = (PosedBody.polygon("as cut", "free", contour.points(OUTLINE_TOLERANCE)) for contour in cut)
    moving = of_printed(result)
    return replace(moving, bodies=(*as_cut, *moving.bodies))
