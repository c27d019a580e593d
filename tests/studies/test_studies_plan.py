"""What varies, read strictly, and the points in their order."""

import numpy as np
import pytest

import cfmkit
from cfmkit.errors import SpecError, UsageError
from cfmkit.families import family, names
from cfmkit.studies.plan import Draw, grid, sample_axes, zip_axes
from cfmkit.studies.variations import axes, collect_variations, leaf, parse_variation, paths

SPEC = cfmkit.load("configs/cam.yaml")
RADIUS = "mechanism.roller_radius"


def read(*options, drawn=False):
    return axes(SPEC, [parse_variation(option) for option in options], drawn)


def test_a_range_has_both_ends_and_short_decimals_between_them():
    (variable,) = grid(read(f"{RADIUS}=4mm:5mm:11")).variables
    assert variable.shown.tolist() == [4.0, 4.1, 4.2, 4.3, 4.4, 4.5, 4.6, 4.7, 4.8, 4.9, 5.0]
    assert variable.values.tolist() == [float(f"0.00{digits}") for digits in (4, *range(41, 50), 5)]


def test_a_range_may_mix_units_of_one_kind_and_run_down():
    (variable,) = grid(read(f"{RADIUS}=1.6 cm:8 mm:3")).variables
    assert variable.shown.tolist() == [16.0, 12.0, 8.0]


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("mechanism.roller_radius=[1mm, 2.5 mm]", (0.001, 0.0025)),
        ("analysis.path_method=[ode, quadrature]", ("ode", "quadrature")),
        ("analysis.gravity=[true, false]", (True, False)),
        ("analysis.points=[11, 21]", (11, 21)),
        ("mechanism.rolling_friction=[0, 1 %]", (0.0, 0.01)),
    ],
)
def test_a_list_holds_numbers_words_and_switches(option, values):
    assert tuple(grid(read(option)).point(k)[0] for k in range(2)) == values


def test_a_value_of_a_list_in_the_spec_varies_by_its_index():
    spec = cfmkit.load("configs/cam_six_springs.yaml")
    plan = grid(axes(spec, [parse_variation("mechanism.springs.stiffness.2=0.6 N/mm:0.7 N/mm:2")]))
    changed = spec.replace({plan.paths[0]: plan.point(0)[0]})
    assert changed.mechanism.springs.stiffness[2] == 600.0
    assert changed.mechanism.springs.stiffness[3] == spec.mechanism.springs.stiffness[3]


@pytest.mark.parametrize(("unit", "dimension"), [("N/mm", "stiffness"), ("N*mm/rad", "rotational_stiffness")])
def test_a_value_of_several_dimensions_knows_which_one_it_has(unit, dimension):
    for values, drawn in (
        (f"[1 {unit}, 2 {unit}]", False),
        (f"1 {unit}:2 {unit}:2", False),
        (f"1 {unit}:2 {unit}", True),
    ):
        asked = read(f"analysis.target.stiffness={values}", drawn=drawn)
        plan = sample_axes(asked, Draw("lhs", 2)) if drawn else grid(asked)
        assert plan.point(1)[0].dimension == dimension


def test_the_first_variable_of_a_grid_varies_slowest():
    plan = grid(read(f"{RADIUS}=[1mm,2mm]", "analysis.points=[11,21,31]"))
    assert [plan.point(k) for k in range(6)] == [
        (radius, points) for radius in (0.001, 0.002) for points in (11, 21, 31)
    ]


def test_blocks_of_a_plan_are_its_points():
    plan = grid(read(f"{RADIUS}=1mm:2mm:7", "analysis.path_method=[ode,quadrature]", "analysis.points=5:9:3"))
    columns = plan.block(5, 30)
    assert [tuple(column.tolist()[k] for column in columns) for k in range(25)] == [plan.point(k) for k in range(5, 30)]
    part = plan.part(5, 30)
    assert [part.point(k) for k in range(25)] == [plan.point(k) for k in range(5, 30)]


def test_side_by_side_needs_equal_numbers():
    plan = zip_axes(read(f"{RADIUS}=[1mm,2mm]", "analysis.points=[11,21]"))
    assert [plan.point(k) for k in range(2)] == [(0.001, 11), (0.002, 21)]
    with pytest.raises(UsageError, match=r"mechanism\.roller_radius has 2, analysis\.points has 3"):
        zip_axes(read(f"{RADIUS}=[1mm,2mm]", "analysis.points=[11,21,31]"))


@pytest.mark.parametrize("method", ["lhs", "sobol"])
def test_samples_repeat_with_their_seed_and_fill_their_ranges_evenly(method):
    wanted = read(f"{RADIUS}=8mm:16mm", "analysis.path_method=[ode,quadrature]", "analysis.points=10:12", drawn=True)
    plan = sample_axes(wanted, Draw(method, 64, 3))
    again, other = sample_axes(wanted, Draw(method, 64, 3)), sample_axes(wanted, Draw(method, 64, 4))
    radius, words, points = plan.block(0, 64)
    assert all(np.array_equal(a, b) for a, b in zip(plan.block(0, 64), again.block(0, 64), strict=True))
    assert not np.array_equal(radius, other.block(0, 64)[0])
    counts, _ = np.histogram(radius, 8, (0.008, 0.016))
    assert counts.tolist() == [8] * 8
    assert sorted(map(words.tolist().count, ("ode", "quadrature"))) == [32, 32]
    assert set(points.tolist()) == {10, 11, 12}


def test_an_absurd_grid_is_refused_before_anything_is_allocated():
    with pytest.raises(UsageError, match="1000000000000000000000000 points are more than 1000000"):
        grid(read(f"{RADIUS}=1mm:2mm:1000000000000", "mechanism.brace_length=1mm:2mm:1000000000000"))
    with pytest.raises(UsageError, match="--max-points 2000000"):
        sample_axes(read(f"{RADIUS}=1mm:2mm", drawn=True), Draw("sobol", 2_000_000))


def test_a_large_grid_holds_its_axes_only():
    plan = grid(read(f"{RADIUS}=1mm:2mm:1000", "mechanism.brace_length=100mm:300mm:1000"))
    assert len(plan) == 1_000_000
    assert sum(len(item.values) for item in plan.variables) == 2000


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("mechanism.roler_radius=1mm:2mm:3", "did you mean 'mechanism.roller_radius'?"),
        ("mechanism.nothing=1mm:2mm:3", "below 'mechanism' there are brace_length"),
        ("roller_radius=1mm:2mm:3", "did you mean 'mechanism.roller_radius'?"),
        ("foo=[1]", "a path starts with mechanism, design, analysis"),
        ("mechanism.springs=[1]", "is a block; vary one of its values: stiffness"),
        ("analysis.window=[1 mm]", "vary one item of it, as analysis.window.0"),
        ("mechanism.springs.stiffness.0=[1 N/mm]", "is below a value"),
        ("requirements.0.max=[5 %]", "is nothing to vary"),
        ("analysis.path_method=[od, ode]", "did you mean 'ode'?"),
        ("analysis.path_method=ode:quadrature:2", "write [quadrature, ode]"),
        (f"{RADIUS}=8:16:5", "8 has no unit; write '8 mm'"),
        (f"{RADIUS}=[8]", "8 has no unit; write '8 mm'"),
        (f"{RADIUS}=8mm:16N:5", "'16 N' is a force"),
        (f"{RADIUS}=8mm:16mm", "write start:stop:n"),
        (f"{RADIUS}=8mm", "write start:stop:n"),
        (f"{RADIUS}=8mm:8mm:3", "starts where it stops"),
        (f"{RADIUS}=8mm:9mm:1", "at least 2 values"),
        (f"{RADIUS}=8mm:9mm:-3", "'-3' is not a number of values"),
        (f"{RADIUS}=8mm:9mm:1e3", "'1e3' is not a number of values"),
        (f"{RADIUS}=[]", "the list is empty"),
        (f"{RADIUS}=[8 mm, 0.8 cm]", "8 mm appears twice"),
        (f"{RADIUS}=[8 mm, {{a: b}}]", "a block is not a length"),
        ("analysis.points=10:21:3", "are no whole numbers"),
        ("analysis.points=[10.5]", "10.5 is not a whole number"),
        ("analysis.gravity=[yes]", "'yes' is not true or false"),
        ("analysis.window.0=[1 mm, 1 deg]", "of several kinds: angle, length"),
    ],
)
def test_what_cannot_vary_is_named_with_the_cure(option, message):
    with pytest.raises(SpecError) as caught:
        read(option)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"--vary {option.partition('=')[0]}: ")


@pytest.mark.parametrize("option", ["mechanism.roller_radius", "mechanism.roller_radius=", "=[1]", "a..b=[1]"])
def test_a_malformed_option_is_a_matter_of_usage(option):
    with pytest.raises(UsageError, match="--vary"):
        parse_variation(option)


def test_every_fault_of_every_request_is_told_at_once():
    with pytest.raises(SpecError) as caught:
        read("mechanism.x=[1]", f"{RADIUS}=8:9:3", "analysis.points=[7]", "analysis.points=[8]")
    assert len(caught.value.problems) == 3
    assert "'analysis.points' is varied already" in str(caught.value)


def test_ranges_to_draw_from_have_no_steps():
    with pytest.raises(SpecError, match="it has no number of steps"):
        read(f"{RADIUS}=8mm:9mm:3", drawn=True)


def test_a_block_of_the_specification_says_the_same_as_options():
    block = collect_variations({RADIUS: "8 mm:16 mm:5", "analysis.path_method": ["ode"]})
    assert grid(axes(SPEC, block)).block(0, 5)[0].tolist() == grid(read(f"{RADIUS}=8mm:16mm:5")).block(0, 5)[0].tolist()


@pytest.mark.parametrize("name", names())
def test_every_path_that_is_offered_can_be_found(name):
    offered = list(paths(family(name).spec_type))
    assert len(offered) > 5
    for path in offered:
        assert leaf(family(name).spec_type, path).path == path
