"""Mechanisms of slender beams in large deflection [Lan, Wang, Chen 2010]."""

from __future__ import annotations

from cfmkit.families.base import Family, Search, when_called
from cfmkit.families.beam.findings import BEAM_FINDINGS
from cfmkit.families.beam.network_from_spec import resolve
from cfmkit.families.beam.scalar_results import SCALAR_DEFINITIONS
from cfmkit.families.beam.spec import BeamSpec
from cfmkit.families.beam.tip_on_uneven_surface import TIP_DEFINITIONS as SURFACE

FAMILY = Family(
    name="beam",
    summary="a planar network of slender beams in large deflection",
    spec_type=BeamSpec,
    models={
        **dict.fromkeys(("inextensible", "extensible", "reissner"), "cfmkit.families.beam.model:analyze"),
        "solid": "cfmkit.families.beam.plane_fem_analysis:analyze",
    },
    design=when_called("cfmkit.families.beam.design:design"),
    search=Search(tables=("starts.csv",)),
    values=SCALAR_DEFINITIONS | SURFACE,
    resolve=resolve,
    rows=when_called("cfmkit.families.beam.beams_in_rows:solve_rows"),
    errors="cfmkit.families.beam.redesign_variables_and_process_errors:errors",
    free="cfmkit.families.beam.redesign_variables_and_process_errors:free",
    sampled="cfmkit.families.beam.force_at_few_poses:sample_poses",
    sampled_slopes="cfmkit.families.beam.force_at_few_poses:sampled_slopes",
    draw="cfmkit.families.beam.figures",
    dimension_drawing="cfmkit/families/beam/dimensions.svg",
    outline="cfmkit.families.beam.outline",
    elastic_parts="cfmkit.families.beam.plane_fem_analysis:elastic_parts",
    elastic_networks="cfmkit.families.beam.plane_fem_analysis:elastic_networks",
    levels=("design.rescale.force", "design.optimise.force.target"),
    propose="cfmkit.families.beam.proposals:propose",
    part="cfmkit.families.beam.part:part_over_motion",
    headline=(
        "nominal_force",
        "range_start",
        "range_fraction",
        "peak_force",
        "usable_stroke",
        "stress_max",
        "stress_limit_displacement",
        "frequency_held_min",
        "frequency_free_min",
    ),
    template="cfmkit/families/beam/template.yaml",
    findings=BEAM_FINDINGS,
    bibliography="cfmkit/families/beam/references.bib",
    references=(
        "C.-C. Lan, J.-H. Wang, Y.-H. Chen, A compliant constant-force mechanism for adaptive robot end-effector "
        "operations, IEEE Int. Conf. Robotics and Automation (2010) 2131-2136",
        "C.-C. Lan, K.-M. Lee, ASME J. Mech. Des. 128 (2006) 765: networks of curved beams",
    ),
)
