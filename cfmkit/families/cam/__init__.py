"""Cam mechanisms: rollers, cam and springs [Sanchez-Salinas et al. 2022]."""

from __future__ import annotations

from cfmkit.families.base import Family, Search, when_called
from cfmkit.families.cam.findings import CAM_FINDINGS
from cfmkit.families.cam.mechanism_from_spec import resolve
from cfmkit.families.cam.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.cam.spec import CamSpec

FAMILY = Family(
    name="cam",
    summary="two rollers on a cam, pulled together by springs and up by braces",
    spec_type=CamSpec,
    models={"quasi-static": "cfmkit.families.cam.model:analyze", "dynamic": "cfmkit.families.cam.dynamics:analyze"},
    design=when_called("cfmkit.families.cam.design:design"),
    search=Search(findings=("overwritten", "plate_incomplete")),
    values=SCALAR_DEFINITIONS,
    resolve=resolve,
    attribution="cfmkit.families.cam.measured_deviation_causes",
    draw="cfmkit.families.cam.figures",
    dimension_drawing="cfmkit/families/cam/dimensions.svg",
    rows=when_called("cfmkit.families.cam.cams_in_rows:solve_rows"),
    outline="cfmkit.families.cam.outline",
    propose="cfmkit.families.cam.proposals:propose",
    part="cfmkit.families.cam.part:part_over_motion",
    free="cfmkit.families.cam.redesign_variables_and_process_errors:free",
    errors="cfmkit.families.cam.redesign_variables_and_process_errors:errors",
    headline=(
        "force_constant",
        "theoretical_force",
        "force_mean",
        "usable_stroke",
        "spring_elongation_max",
        "contact_force_max",
    ),
    branches=("load", "unload"),
    template="cfmkit/families/cam/template.yaml",
    findings=CAM_FINDINGS,
    bibliography="cfmkit/families/cam/references.bib",
    references=(
        "S. Sanchez-Salinas, A. Garcia-Agundez, J. Lopez-Martinez, D. Garcia-Vallejo, "
        "Mech. Mach. Theory 173 (2022) 104819, doi:10.1016/j.mechmachtheory.2022.104819",
    ),
)
