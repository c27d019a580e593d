"""Record by which the registry knows cam mechanisms: their models, design, proposals, pictures and names of results."""

from __future__ import annotations

from cfmkit.families.base import DesignMethod, Family, Pictures, ResultNames
from cfmkit.families.cam.findings import CAM_FINDINGS
from cfmkit.families.cam.measured_cam import PROFILE_DEFINITIONS
from cfmkit.families.cam.measured_deviation_causes import DEVIATION_DEFINITIONS
from cfmkit.families.cam.mechanism_from_spec import resolve
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.cam.spec import CamSpec
from cfmkit.families.deferred_imports import deferred_imports

with deferred_imports():
    from cfmkit.families.cam.design import design
    from cfmkit.families.cam.dynamics import analyze as analyze_motion
    from cfmkit.families.cam.figures import figures, moving
    from cfmkit.families.cam.measured_deviation_causes import attribute_deviation
    from cfmkit.families.cam.model import analyze, solve_rows
    from cfmkit.families.cam.outline import drawing
    from cfmkit.families.cam.part import part_over_motion
    from cfmkit.families.cam.proposals import propose
    from cfmkit.families.cam.redesign_variables_and_process_errors import errors, free

FAMILY_RECORD = Family(
    name="cam",
    summary="two rollers on a cam, pulled together by springs and up by braces",
    spec_type=CamSpec,
    models={"quasi-static": analyze, "dynamic": analyze_motion},
    outputs=ResultNames(
        values=SCALAR_DEFINITIONS | PROFILE_DEFINITIONS,
        causes=DEVIATION_DEFINITIONS,
        findings=CAM_FINDINGS,
        headline=(
            "force_constant",
            "theoretical_force",
            "force_mean",
            "usable_stroke",
            "spring_elongation_max",
            "contact_force_max",
        ),
        branches=("load", "unload"),
    ),
    folder="cfmkit/families/cam",
    resolve=resolve,
    design=DesignMethod(design, findings=("overwritten", "plate_incomplete")),
    rows=solve_rows,
    free=free,
    errors=errors,
    attribution=attribute_deviation,
    draw=Pictures(figures, moving),
    outline=drawing,
    propose=propose,
    part=part_over_motion,
)
