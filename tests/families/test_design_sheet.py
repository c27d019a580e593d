"""Designs from a sheet: widths stay, and thickness, length, angle and number follow from the force."""

import pytest

import cfmkit
from cfmkit.families import family
from cfmkit.metrics import check
from cfmkit.results import Status

FLEXURES = [f"mechanism.flexures.{name}.width" for name in ("pivot", "crank_pin", "slider_pin")]
LEAVES = ["mechanism.bistable.width", "mechanism.positive.width"]


def cut(name: str, sheet: str, widths: list[str], *changes: str) -> cfmkit.Spec:
    """Return a shipped specification that is cut from a sheet."""
    both = [f"{path}={sheet}" for path in ["mechanism.part.sheet", *widths]]
    return cfmkit.load(f"configs/{name}.yaml", [*both, *changes])


@pytest.mark.parametrize(("sheet", "leaves"), [("1 mm", 2), ("0.6 mm", 4)])
def test_a_vcfm_from_a_sheet_meets_its_requirements_with_the_widths_as_they_were(sheet, leaves):
    made = cfmkit.design(cut("vcfm_titanium", sheet, LEAVES))
    about = made.spec.mechanism
    assert about.bistable.width == about.positive.width == about.part.sheet
    assert about.bistable.half_beams == leaves
    result = cfmkit.analyze(made.spec.replace({"analysis.fidelity": "exact"}))
    met = [one.ok for one in check(result.spec.requirements, result)]
    assert met == [True] * 4


def test_a_sheet_below_twice_the_thickness_of_its_leaves_is_named_with_one_that_is_enough():
    design = cfmkit.design(cut("vcfm_titanium", "0.4 mm", LEAVES))
    assert design.status is Status.INFEASIBLE
    assert "sheet of 0.4 mm" in design.message
    assert design.nearest_feasible["mechanism.part.sheet"] == "0.5093 mm"


def test_leaves_from_a_sheet_have_no_stated_length():
    with pytest.raises(cfmkit.SpecError, match="from a sheet follows from the force"):
        cut("vcfm_titanium", "1 mm", LEAVES, "design.leaf_length=18 mm")


def test_leaves_around_bought_springs_are_as_wide_as_the_sheet():
    made = cfmkit.design(cut("vcfm_bought_springs", "5 mm", LEAVES[:1]))
    assert made.spec.mechanism.bistable.width == 5e-3
    assert made.status is Status.COMPLETE


@pytest.mark.parametrize("sheet", ["4 mm", "2 mm"])
def test_flexures_from_a_sheet_have_the_force_of_the_springs_within_the_stress(sheet):
    free = cfmkit.design(cfmkit.load("configs/slider_crank_lumped.yaml"))
    made = cfmkit.design(cut("slider_crank_lumped", sheet, FLEXURES))
    own = made.spec.mechanism.flexures
    assert {one.width for one in own.all} == {made.spec.mechanism.part.sheet}
    assert all(one.length >= 10.8e-3 for one in own.all)
    forces = [cfmkit.analyze(one.spec).curve for one in (made, free)]
    assert forces[0].force[-1] == pytest.approx(forces[1].force[-1], rel=5e-3)
    assert forces[0].extra["max_stress"].values.max() <= 42.5e6 * (1 + 1e-6)


def test_flexures_of_a_stated_length_that_a_sheet_overstresses_are_infeasible_with_a_length_that_is_enough():
    found = cfmkit.design(cut("slider_crank_lumped", "2 mm", FLEXURES, "design.flexures.length=10.8 mm"))
    assert found.status is Status.INFEASIBLE
    longer = found.nearest_feasible["design.flexures.length"]
    again = cfmkit.design(cut("slider_crank_lumped", "2 mm", FLEXURES, f"design.flexures.length={longer}"))
    assert again.status is Status.COMPLETE


@pytest.mark.parametrize("stated", [["design.beam.width=6 mm"], ["mechanism.part.sheet=6 mm"]])
def test_a_uniform_strip_of_a_stated_width_has_its_thickness_from_the_force(stated):
    made = cfmkit.design(cfmkit.load("configs/slider_crank_strip.yaml", ["mechanism.beam.width=6 mm", *stated]))
    assert made.spec.mechanism.beam.width == 6e-3
    force = cfmkit.analyze(made.spec.replace({"requirements": ()})).curve.force
    window = force[len(force) // 20 :]
    assert 0.5 * (window.max() + window.min()) == pytest.approx(1.5, rel=0.02)


def test_a_strip_that_a_sheet_makes_too_weak_says_which_force_it_has():
    found = cfmkit.design(cut("slider_crank_strip", "5 mm", ["mechanism.beam.width"]))
    assert found.status is Status.INFEASIBLE
    assert found.nearest_feasible == {"design.force": "1.45 N"}


def test_beams_from_a_sheet_are_rescaled_by_their_thickness():
    changes = ["design.rescale={force: 20 N, material: pom}"]
    made = cfmkit.design(cut("beam_rescaled", "10 mm", [], *changes))
    about = made.spec.mechanism
    assert about.width == about.part.sheet == 10e-3
    force = cfmkit.analyze(made.spec).curve
    end = abs(force.displacement - float(made.spec.analysis.window[1])).argmin()
    assert force.force[end] == pytest.approx(20.0, rel=1e-3)  # thickness has three decimals


@pytest.mark.parametrize("wanted", ["{force: 20 N, free: size, width: 12 mm}", "{force: 20 N, thickness: 1.2 mm}"])
def test_what_a_rescaled_sheet_cannot_have_is_named(wanted):
    with pytest.raises(cfmkit.SpecError, match="the sheet"):
        cut("beam_rescaled", "10 mm", [], f"design.rescale={wanted}")


@pytest.mark.parametrize(
    ("name", "sheet", "widths"),
    [
        ("vcfm_titanium", "1 mm", LEAVES),
        ("slider_crank_strip", "6 mm", ["mechanism.beam.width"]),
        ("beam_rescaled", "10 mm", []),
    ],
)
def test_no_margin_moves_a_width_that_a_sheet_has(name, sheet, widths):
    spec = cut(name, sheet, widths)
    moving = family(spec.family).free(spec, spec)
    assert moving
    assert not any(path.endswith("width") for path in moving)
