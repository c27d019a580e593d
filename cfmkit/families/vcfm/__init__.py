"""Mechanisms of snap-through leaves and a preloaded spring [Ding, Li and Li 2022]."""

from __future__ import annotations

from cfmkit.families.base import Family, when_called
from cfmkit.families.vcfm.findings import VCFM_FINDINGS
from cfmkit.families.vcfm.quantities import SCALAR_DEFINITIONS
from cfmkit.families.vcfm.spec import VcfmSpec

FAMILY = Family(
    name="vcfm",
    summary="V-beams that snap through beside a diamond spring, adjustable by the spring's preload",
    spec_type=VcfmSpec,
    errors="cfmkit.families.vcfm.redesign_variables_and_process_errors:errors",
    free="cfmkit.families.vcfm.redesign_variables_and_process_errors:free",
    models={
        "truss": "cfmkit.families.vcfm.model:analyze",
        "analytic": "cfmkit.families.vcfm.model:analyze",
        "exact": "cfmkit.families.vcfm.exact_model:analyze",
        "solid": "cfmkit.families.vcfm.plane_fem_analysis:analyze",
    },
    design=when_called("cfmkit.families.vcfm.design:design"),
    values=SCALAR_DEFINITIONS,
    draw="cfmkit.families.vcfm.figures",
    dimension_drawing="cfmkit/families/vcfm/dimensions.svg",
    outline="cfmkit.families.vcfm.outline",
    elastic_parts="cfmkit.families.vcfm.plane_fem_analysis:elastic_parts",
    elastic_networks="cfmkit.families.vcfm.exact_model:elastic_networks",
    levels=("design.force",),
    propose="cfmkit.families.vcfm.proposals:propose",
    part="cfmkit.families.vcfm.part:part_over_motion",
    rows=when_called("cfmkit.families.vcfm.model:solve_rows"),
    headline=(
        "constant_force",
        "window_force",
        "positive_stiffness",
        "negative_stiffness",
        "window_length",
        "force_per_preload",
        "rest_shift_max",
        "spring_stress_max",
        "bistable_stress_max",
        "travel_stress_max",
        "travel_safety_factor",
    ),
    branches=("load",),
    template="cfmkit/families/vcfm/template.yaml",
    findings=VCFM_FINDINGS,
    bibliography="cfmkit/families/vcfm/references.bib",
    references=(
        "B. Ding, X. Li, Y. Li, Configuration design and experimental verification of a variable constant-force "
        "compliant mechanism, Robotica (2022)",
    ),
)
