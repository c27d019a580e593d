"""Slider-crank mechanisms with springs at their joints [Li, Hao 2019; Bilancia et al. 2019]."""

from __future__ import annotations

from cfmkit.families.base import Family, Search, when_called
from cfmkit.families.end_stops import OF_STOPS
from cfmkit.families.slider_crank.findings import SLIDER_CRANK_FINDINGS
from cfmkit.families.slider_crank.linkage_from_spec import resolve
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_DEFINITIONS as OF_PARTS
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.bistability_class import CLASS_NAMES
from cfmkit.families.slider_crank.springs.scalar_results import SCALAR_DEFINITIONS as OF_SPRINGS

PRINTED_MODEL = "cfmkit.families.slider_crank.printed.model:analyze"
"""One model for flexures and strips: the chain is another one."""

SOLID_MODEL = "cfmkit.families.slider_crank.printed.plane_fem_analysis:analyze"
"""The part as drawn, of flexures or a strip."""

FAMILY = Family(
    name="slider-crank",
    summary="a crank, a coupler and a slider with a spring at each joint: constant torque or force",
    spec_type=SliderCrankSpec,
    models={
        "prb": "cfmkit.families.slider_crank.springs.model:analyze",
        "lumped": PRINTED_MODEL,
        "beam": PRINTED_MODEL,
        "solid": SOLID_MODEL,
    },
    rows=when_called("cfmkit.families.slider_crank.springs.model:solve_rows"),
    design=when_called("cfmkit.families.slider_crank.design:design"),
    search=Search(findings=("near_optima", "spring_dropped", "window_not_proven")),
    values=OF_SPRINGS | OF_PARTS | OF_STOPS,
    words={"stiffness_class": CLASS_NAMES},
    resolve=resolve,
    errors="cfmkit.families.slider_crank.redesign_variables_and_process_errors:errors",
    sampled="cfmkit.families.slider_crank.force_at_few_poses:sample_poses",
    free="cfmkit.families.slider_crank.redesign_variables_and_process_errors:free",
    gradient=when_called("cfmkit.families.slider_crank.springs.model:gradient"),
    draw="cfmkit.families.slider_crank.figures",
    dimension_drawing="cfmkit/families/slider_crank/dimensions.svg",
    outline="cfmkit.families.slider_crank.outline",
    elastic_parts="cfmkit.families.slider_crank.printed.plane_fem_analysis:elastic_parts",
    elastic_networks="cfmkit.families.slider_crank.printed.plane_fem_analysis:elastic_networks",
    levels=("design.force",),
    propose="cfmkit.families.slider_crank.proposals:propose",
    part="cfmkit.families.slider_crank.part:part_over_motion",
    headline=("stiffness_class", "band_range_05pct", "half_band", "energy_max", "crank_pin_rotation_max"),
    template="cfmkit/families/slider_crank/template.yaml",
    findings=SLIDER_CRANK_FINDINGS,
    bibliography="cfmkit/families/slider_crank/references.bib",
    references=(
        "B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019), doi:10.1186/s10033-019-0369-z",
        "P. Bilancia, A. Geraci, G. Berselli, ASME SMASIS 2019, SMASIS2019-5519",
    ),
)
