"""Record of the slider-crank mechanisms with springs at their joints [Li, Hao 2019; Bilancia et al. 2019]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.families.base import DesignMethod, ElasticParts, Family, Pictures, ResultNames
from cfmkit.families.deferred_imports import deferred_imports
from cfmkit.families.end_stops import STOP_QUANTITIES
from cfmkit.families.slider_crank.findings import SLIDER_CRANK_FINDINGS
from cfmkit.families.slider_crank.linkage import resolve
from cfmkit.families.slider_crank.printed.scalar_results import SCALAR_DEFINITIONS as OF_PARTS
from cfmkit.families.slider_crank.spec import SliderCrankSpec
from cfmkit.families.slider_crank.springs.bistability_class import CLASS_NAMES
from cfmkit.families.slider_crank.springs.scalar_results import SCALAR_DEFINITIONS as OF_SPRINGS

with deferred_imports():
    from cfmkit.families.slider_crank.force_at_few_poses import sample_poses
    from cfmkit.families.slider_crank.outline import drawing
    from cfmkit.families.slider_crank.part import part_over_motion
    from cfmkit.families.slider_crank.printed.design import design as design_part
    from cfmkit.families.slider_crank.printed.figures import figures as figures_of_part
    from cfmkit.families.slider_crank.printed.figures import moving as moving_part
    from cfmkit.families.slider_crank.printed.model import analyze as analyze_printed
    from cfmkit.families.slider_crank.printed.plane_fem_analysis import analyze as analyze_solid
    from cfmkit.families.slider_crank.printed.plane_fem_analysis import elastic_networks, elastic_parts
    from cfmkit.families.slider_crank.proposals import propose
    from cfmkit.families.slider_crank.redesign_variables_and_process_errors import errors, free
    from cfmkit.families.slider_crank.springs.design import design as design_springs
    from cfmkit.families.slider_crank.springs.figures import figures as figures_of_springs
    from cfmkit.families.slider_crank.springs.figures import moving as moving_springs
    from cfmkit.families.slider_crank.springs.model import analyze, gradient, solve_rows

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from cfmkit.families.run_control import Run
    from cfmkit.plots.mechanism_in_motion import Moving
    from cfmkit.results import Design, Result


def design(spec: SliderCrankSpec, run: Run) -> Design:
    """Return the design of springs, or of the part that the block `design` asks for."""
    wanted = spec.design
    is_part = wanted is not None and (wanted.beam is not None or wanted.flexures is not None)
    return (design_part if is_part else design_springs)(spec, run)


def figures(result: Result) -> dict[str, Callable[[], Figure]]:
    """Return what draws each picture of springs or of a printed part, by file stem; empty if nothing was solved."""
    spec: Any = result.spec
    if result.state is None or not result.curves:
        return {}
    return (figures_of_springs if spec.built_as == "springs" else figures_of_part)(result)


def moving(result: Result) -> Moving | None:
    """Return the linkage or the part over its motion, for a film; None of a part solved as a solid."""
    spec: Any = result.spec
    return (moving_springs if spec.built_as == "springs" else moving_part)(result)


FAMILY_RECORD = Family(
    name="slider-crank",
    summary="a crank, a coupler and a slider with a spring at each joint: constant torque or force",
    spec_type=SliderCrankSpec,
    models={"prb": analyze, "lumped": analyze_printed, "beam": analyze_printed, "solid": analyze_solid},
    outputs=ResultNames(
        values=OF_SPRINGS | OF_PARTS | STOP_QUANTITIES,
        words={"stiffness_class": CLASS_NAMES},
        findings=SLIDER_CRANK_FINDINGS,
        headline=("stiffness_class", "band_range_05pct", "half_band", "energy_max", "crank_pin_rotation_max"),
    ),
    folder="cfmkit/families/slider_crank",
    resolve=resolve,
    design=DesignMethod(
        design, levels=("design.force",), findings=("near_optima", "spring_dropped", "window_not_proven")
    ),
    rows=solve_rows,
    gradient=gradient,
    sample=sample_poses,
    free=free,
    errors=errors,
    draw=Pictures(figures, moving),
    outline=drawing,
    elastic=ElasticParts(elastic_parts, elastic_networks),
    propose=propose,
    part=part_over_motion,
)
