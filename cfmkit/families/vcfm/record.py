"""Record by which the registry knows vcfms: their models, design, proposals, pictures and names of results."""

from __future__ import annotations

from cfmkit.families.base import DesignMethod, ElasticParts, Family, Pictures, ResultNames
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit.families.vcfm.findings import VCFM_FINDINGS
from cfmkit.families.vcfm.quantities import SCALAR_DEFINITIONS
from cfmkit.families.vcfm.spec import VcfmSpec

with deferred_imports():
    from cfmkit.families.vcfm.design import design
    from cfmkit.families.vcfm.exact_model import analyze as analyze_exactly
    from cfmkit.families.vcfm.exact_model import elastic_networks
    from cfmkit.families.vcfm.figures import figures, moving
    from cfmkit.families.vcfm.model import analyze, solve_rows
    from cfmkit.families.vcfm.outline import drawing
    from cfmkit.families.vcfm.part import part_over_motion
    from cfmkit.families.vcfm.plane_fem_analysis import analyze as analyze_solid
    from cfmkit.families.vcfm.plane_fem_analysis import elastic_parts
    from cfmkit.families.vcfm.proposals import propose
    from cfmkit.families.vcfm.redesign_variables_and_process_errors import errors, free

FAMILY_RECORD = Family(
    name="vcfm",
    summary="V-beams that snap through beside a diamond spring, adjustable by the spring's preload",
    spec_type=VcfmSpec,
    models={"truss": analyze, "analytic": analyze, "exact": analyze_exactly, "solid": analyze_solid},
    outputs=ResultNames(
        values=SCALAR_DEFINITIONS,
        findings=VCFM_FINDINGS,
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
    ),
    folder="cfmkit/families/vcfm",
    design=DesignMethod(design, levels=("design.force",)),
    rows=solve_rows,
    free=free,
    errors=errors,
    draw=Pictures(figures, moving),
    outline=drawing,
    elastic=ElasticParts(elastic_parts, elastic_networks),
    propose=propose,
    part=part_over_motion,
)
