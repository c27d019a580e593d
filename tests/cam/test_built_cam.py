"""Cams as they were built: from a file with measured points to forces; points are made by formulas in `flanks`."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from flanks import Errors, flanks, measured, parameters

import cfmkit
from cfmkit.errors import DataError, SpecError
from cfmkit.families.cam.measured_cam_analysis import built_flank, built_track, flanks_of
from cfmkit.families.cam.mechanism_from_spec import assemble

CONFIG = (Path(__file__).parents[2] / "configs/cam.yaml").read_text()


def write(folder, points, head="side;x [mm];y [mm]"):
    lines = [
        f"{side};{x:.9f};{y:.9f}" for side, item in zip(("right", "left"), points, strict=True) for x, y in item * 1e3
    ]
    (folder / "measured.csv").write_text("\n".join([head, *lines]) + "\n")


def spec_of(folder, noise="0.002 mm", window="[40 mm, 120 mm]", file="measured.csv"):
    text = CONFIG.replace("stroke: 240 mm}", f"stroke: 240 mm, file: {file}, noise: {noise}}}", 1)
    (folder / "cam.yaml").write_text(text.replace("window: [2 mm, 100 %]", f"window: {window}"))
    return cfmkit.load(folder / "cam.yaml")


def built(folder, errors=None, noise="0.002 mm"):
    write(folder, measured(errors))
    return cfmkit.analyze(spec_of(folder, noise))


def test_exact_points_give_the_forces_of_the_design(tmp_path):
    found = built(tmp_path, Errors(), "0.000000001 mm")
    designed = cfmkit.analyze(cfmkit.load(Path(__file__).parents[2] / "configs/cam.yaml")).curve
    for branch in ("load", "unload"):
        one, other = found.curve.select_branch(branch), designed.select_branch(branch)
        order = np.argsort(other.motion)
        expected = np.interp(one.motion, other.motion[order], other.effort[order])
        assert np.abs(one.effort - expected)[one.motion > 0.005].max() < 2e-4
    assert found.values["profile_force_share"].value < 1e-8
    assert found.values["registration_angle"].value == pytest.approx(np.radians(-0.3), abs=1e-12)


def test_a_measured_cam_has_the_values_of_any_cam_and_says_when_springs_and_friction_do_not_allow_it(tmp_path):
    exact, designed = built(tmp_path, Errors(), "0.000000001 mm"), cfmkit.load(tmp_path / "cam.yaml")
    designed = cfmkit.analyze(designed.replace({"mechanism.profile.file": None, "mechanism.profile.noise": None}))
    for name in ("force_constant", "spring_stiffness", "theoretical_force"):
        assert exact.values[name].value == pytest.approx(designed.values[name].value, rel=1e-12), name
    stretched = np.interp(exact.curve.motion[:481], designed.curve.motion[:481],
                          designed.curve.extra["spring_elongation"].values[:481]).max()  # fmt: skip
    assert exact.values["spring_elongation_max"].value == pytest.approx(stretched, rel=1e-5)
    assert exact.values["contact_force_max"].value == pytest.approx(
        max(exact.curve.extra["contact_force_right"].values), rel=1e-9
    )
    spec = spec_of(tmp_path).replace({"mechanism.springs.max_elongation": 0.09, "mechanism.rolling_friction": 0.6})
    found = {item.name: item.message for item in cfmkit.analyze(spec).warnings}
    assert found["spring_overstretched"].startswith("the springs are stretched by 99.31 mm")
    assert "friction (0.6) holds a roller at" in found["up_jam"]
    long = spec_of(tmp_path).replace({"mechanism.rest_half_width": 0.08, "mechanism.profile.rest_half_width": 0.068})
    assert "spring_slack" in {item.name for item in cfmkit.analyze(long).warnings}


def test_the_parts_of_the_force_add_up_to_it(tmp_path):
    write(tmp_path, measured(Errors(waviness=0.01e-3, noise=0.001e-3)))
    spec = spec_of(tmp_path).replace({"mechanism.rest_half_width": 0.06825, "mechanism.profile.rest_half_width": 0.068})
    curve = cfmkit.analyze(spec).curve
    names = ("force_of_design", "added_by_rest_length", "added_by_profile", "added_by_friction")
    assert sum(curve.extra[name].values for name in names) == pytest.approx(curve.effort, abs=1e-10)
    assert curve.extra["force_of_design"].values == pytest.approx(np.full(len(curve), 4 * 1380 * 0.009058), rel=1e-9)
    # 0.25 mm more on each side: F/F0 = 1 - d/D
    elongation = curve.extra["spring_elongation"].values / 2 + 0.00025
    assert curve.extra["added_by_rest_length"].values == pytest.approx(
        -curve.extra["force_of_design"].values * 0.00025 / elongation, rel=1e-2
    )


def test_the_force_of_a_long_wave_is_that_of_its_slope(tmp_path):
    """The contact's normal turns by e' = 2 pi a / L; the force by e' (1 + f^2) A / D at most: the note's eps/mu."""
    wave = Errors(waviness=0.01e-3, length=40e-3)
    share = built(tmp_path, wave, "0.00001 mm").curve.select_branch("load")
    inside = (share.motion > 0.05) & (share.motion < 0.13)
    largest = np.abs(share.extra["added_by_profile"].values[inside]).max() / 50.0
    slope = 2 * np.pi * 0.01e-3 / 40e-3
    # eps/mu is 4.48 at 40 mm and 6.84 at 120 mm; the two flanks' waves are a radian apart.
    assert 4.5 * np.cos(0.5) < largest / slope < 7.1


def test_the_registered_errors_are_those_that_were_made(tmp_path):
    found = built(tmp_path, Errors(waviness=0.02e-3, noise=0.002e-3)).values
    assert found["profile_sd"].value == pytest.approx(0.02e-3 / 2**0.5, rel=0.05)
    assert found["profile_sd_x"].value > found["profile_sd"].value


def test_a_loop_area_gives_back_the_friction(tmp_path):
    found = built(tmp_path, Errors(waviness=0.01e-3, noise=0.001e-3))
    area = cfmkit.evaluate(found, ["hysteresis_area"])["hysteresis_area"].value
    assert area / found.values["loop_area_per_friction"].value == pytest.approx(0.002, rel=5e-3)


def test_places_and_extremes_of_a_measured_cam_do_not_depend_on_the_number_of_points(tmp_path):
    """With 31 points a band of 0.5 % was 14 % too long, and the loop of the window 5 % too small."""
    built(tmp_path, Errors())
    names = ("band_range_05pct", "band_range_1pct", "usable_stroke", "force_max", "force_min", "force_ripple")
    spec = spec_of(tmp_path, window="[41 mm, 119.7 mm]")
    few, many = (cfmkit.analyze(spec.replace({"analysis.points": points})) for points in (31, 601))
    for name in names:
        assert few.metrics[name].value == pytest.approx(many.metrics[name].value, rel=1e-9), name
    loop = "loop_area_per_friction"
    assert few.values[loop].value == pytest.approx(many.values[loop].value, rel=1e-3)


def test_different_flanks_give_different_contact_forces(tmp_path):
    right, left = measured(), measured(Errors(waviness=0.02e-3))
    write(tmp_path, [right[0], left[1]])
    extra = cfmkit.analyze(spec_of(tmp_path)).curve.extra
    assert np.ptp(extra["contact_force_right"].values - extra["contact_force_left"].values) > 0.5


def test_a_roller_bridges_hollows_narrower_than_itself():
    """Waves of 1 mm and 0.02 mm have hollows of 1.3 mm radius: the 16 mm roller runs on their crests.

    Between two crests it sinks by L^2/8 (1/r + 1/rho), 8 to 10 um, far from the 40 um to the floor.
    """
    from cam_support import cam

    assembly = assemble(cam())
    flank = flanks_of(assembly)[0]
    u = np.linspace(flank.ends[0], flank.ends[1], 6000)
    along = np.cumsum(np.concatenate([[0.0], np.hypot(*np.diff(flank.frame(u).points, axis=0).T)]))
    track = built_track(built_flank(flank, u, 0.02e-3 * np.sin(2 * np.pi * along / 1e-3), 0.0), 0.016, 0.2)
    inside = (track.slider > track.slider[0] + 0.05) & (track.slider < track.slider[-1] - 0.01)
    path = assembly.profile.path
    slope = path.law.slope(track.x[inside])
    lift = (path.height(track.x[inside]) - track.y[inside]) / np.hypot(1.0, slope)
    assert 0.010e-3 < lift.min() < 0.0135e-3
    assert lift.max() < 0.0205e-3


def test_what_is_uncertain_and_what_was_not_measured_is_reported(tmp_path):
    found = built(tmp_path, Errors(waviness=0.01e-3, noise=0.002e-3))
    assert {item.name for item in found.warnings} >= {"registration_weak", "part_measured"}
    assert found.status.key == "complete"
    write(tmp_path, measured())
    longer = cfmkit.analyze(spec_of(tmp_path).replace({"analysis.travel": 0.2}))
    assert longer.status.key == "partial"
    assert "measured up to 136.1 mm of travel only" in longer.message


def test_a_travel_that_ends_before_the_first_measured_point_is_refused(tmp_path):
    write(tmp_path, [side[side[:, 1] > 0.03] for side in measured()])
    spec = spec_of(tmp_path).replace({"analysis.window": None, "requirements": ()})
    motion = cfmkit.analyze(spec.replace({"analysis.travel": 0.02})).curve.select_branch("load").motion
    assert (motion[0], motion[-1]) == (pytest.approx(0.01795, abs=1e-5), pytest.approx(0.02))
    with pytest.raises(DataError, match=r"is 5 mm, but the flanks were measured from 17.95 mm of travel on only"):
        cfmkit.analyze(spec.replace({"analysis.travel": 0.005}))


def test_the_spec_survives_changes_and_pickling(tmp_path):
    write(tmp_path, measured())
    spec = spec_of(tmp_path)
    changed = pickle.loads(pickle.dumps(spec.replace({"mechanism.rolling_friction": 0.003})))
    assert changed.get_value("mechanism.profile.file").path == tmp_path / "measured.csv"
    assert cfmkit.analyze(changed).status.key == "complete"
    assert "file: measured.csv" in cfmkit.dumps(spec)


@pytest.mark.parametrize("name", ["../measured.csv", "/etc/passwd", "nothing.csv", "."])
def test_a_file_outside_the_folder_or_missing_is_refused_with_its_place(tmp_path, name):
    inner = tmp_path / "inner"
    inner.mkdir()
    write(tmp_path, measured())
    with pytest.raises(SpecError, match=r"cam.yaml:\d+:\d+: mechanism.profile.file: "):
        spec_of(inner, file=name)


@pytest.mark.parametrize(
    ("key", "complaint"),
    [("file: measured.csv", "'file' and 'noise' belong together"), ("registration: datum", "it needs a 'file'")],
)
def test_keys_of_measured_points_belong_together(tmp_path, key, complaint):
    write(tmp_path, measured())
    (tmp_path / "cam.yaml").write_text(CONFIG.replace("stroke: 240 mm}", f"stroke: 240 mm, {key}}}", 1))
    with pytest.raises(SpecError, match=complaint):
        cfmkit.load(tmp_path / "cam.yaml")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("x;y\n" + "1;2\n" * 30, "the column 'x' needs a unit of length in the header: 'x [mm]'"),
        ("a [mm];b [mm]\n" + "1;2\n" * 30, "needs a header with columns 'x [mm]' and 'y [mm]'"),
        ("x [mm];y [mm]\n" + "60;2\n" * 30, "both flanks are needed with at least 20 points each"),
        ("x [mm];y [N]\n" + "60;2\n" * 30, "the column 'y' needs a unit of length"),
        ("side;x [mm];y [mm]\n" + "middle;60;2\n" * 30, "the side is 'middle'; it must be 'left' or 'right'"),
        (
            "x [mm];y [mm]\n" + "60;2\n" * 9 + "60;NaN\n" + "60;3\n" * 30,
            "line 11: column 'y' [mm] holds 'NaN', which is not a number",
        ),
        ("", "the file is empty"),
    ],
)
def test_bad_points_are_refused_in_one_line(tmp_path, text, complaint):
    (tmp_path / "measured.csv").write_text(text)
    with pytest.raises(DataError, match=re.escape(complaint)) as caught:
        cfmkit.analyze(spec_of(tmp_path))
    assert str(caught.value).startswith("measured.csv: ")
    assert "\n" not in str(caught.value)


SIDES = "the points of the right flank have smaller x than those of the left one"
NOT_HERE = "points of a flank lie on the design; is it the same cam, with x across, y upwards and the right units?"


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda right, left: (left, right), SIDES),
        (lambda right, left: (-right, -left), SIDES),
        (lambda right, left: (right * [1, -1], left * [1, -1]), NOT_HERE),
        (lambda right, left: (1e-3 * right, 1e-3 * left), NOT_HERE),
        (lambda right, left: (right, left[:0]), "both flanks are needed with at least 20 points each"),
        (lambda right, left: (1.3 * right, 1.3 * left), "the points are still"),
    ],
    ids=["sides exchanged", "half a turn", "upside down", "wrong unit", "one flank missing", "another cam"],
)
def test_points_that_are_not_this_cam_are_refused_with_what_to_look_at(tmp_path, change, complaint):
    write(tmp_path, change(*measured(Errors(noise=0.002e-3))))
    with pytest.raises(DataError, match=re.escape(complaint)):
        cfmkit.analyze(spec_of(tmp_path))


@pytest.mark.parametrize(
    ("noise", "stated", "found"),
    [
        (0.002e-3, "0.002 mm", None),
        (0.02e-3, "0.002 mm", "noise_understated"),
        (0.002e-3, "0.1 mm", "noise_overstated"),
    ],
)
def test_a_stated_noise_that_the_points_contradict_is_reported(tmp_path, noise, stated, found):
    names = {item.name for item in built(tmp_path, Errors(waviness=0.01e-3, noise=noise), stated).warnings}
    assert names & {"noise_understated", "noise_overstated"} == ({found} if found else set())


def test_points_far_off_are_left_out_and_counted(tmp_path):
    points = measured(Errors(waviness=0.01e-3, noise=0.002e-3))
    for item in points:
        item[7::50, 0] += 0.5e-3
    write(tmp_path, points)
    warnings = {item.name: item.message for item in cfmkit.analyze(spec_of(tmp_path)).warnings}
    assert warnings["profile_outliers"].startswith("12 of 600 points are far off")


def test_what_a_width_error_is_taken_for_is_told_with_the_weak_direction(tmp_path):
    found = built(tmp_path, Errors(waviness=0.01e-3, noise=0.002e-3))
    lifted = found.values["registration_y_per_width"].value
    assert 3 < lifted < 4
    (message,) = [item.message for item in found.warnings if item.name == "registration_weak"]
    assert "% the shift in y; " in message
    assert f"a cam that lies {0.01 * lifted:.4g} mm lower" in message


@pytest.mark.parametrize("waves", [{}, {"noise": 0.002e-3}, {"waviness": 0.015e-3, "noise": 0.002e-3}])
@pytest.mark.parametrize("offset", [-0.05e-3, 0.05e-3, 0.12e-3])
def test_a_cam_that_is_wider_has_the_force_of_one_cut_with_that_offset_from_its_start(tmp_path, offset, waves):
    found = built(tmp_path, Errors(offset=offset, **waves))
    assert found.values["profile_outliers"].value < 6
    assert found.values["registration_width"].value == pytest.approx(offset, abs=0.006e-3)
    warnings = {item.name: item.message for item in found.warnings}
    assert ("more" if offset > 0 else "less") in warnings["width_error"]
    spec = cfmkit.load(tmp_path / "cam.yaml")
    cut = spec.replace(
        {"mechanism.profile.file": None, "mechanism.profile.noise": None, "mechanism.profile.offset": offset}
    )
    truth = cfmkit.analyze(cut).curve.select_branch("load")
    curve = found.curve.select_branch("load")
    assert curve.motion[0] < 2.7e-3  # the points begin at 15.5 mm of height
    inside = curve.motion > 0.006
    expected = np.interp(curve.motion[inside], truth.motion, truth.effort)
    errors = curve.effort[inside] - expected
    # Waves add forces of their own, as large as half a newton, which change their sign.
    assert abs(errors.mean()) < (0.02 if "waviness" not in waves else 0.1)


def test_taken_for_a_motion_a_wider_cam_is_registered_as_before(tmp_path):
    write(tmp_path, measured(Errors(offset=0.05e-3)))
    spec = spec_of(tmp_path).replace({"mechanism.profile.registration": "motion"})
    found = cfmkit.analyze(spec)
    assert found.values["registration_width"].value == 0
    assert "width_error" not in {item.name for item in found.warnings}


def test_long_waves_are_not_taken_for_a_width(tmp_path):
    found = built(tmp_path, Errors(waviness=0.02e-3, length=120e-3, noise=0.002e-3))
    assert found.values["registration_width"].value == 0


def test_points_in_the_datum_of_the_part_stay_where_they_are(tmp_path):
    """A cam that was mounted 0.5 mm too high: nothing of that is registered away."""
    write(tmp_path, measured(Errors(noise=0.001e-3), move=(0.0, np.array([0.0, 0.5e-3]))))
    spec = spec_of(tmp_path).replace({"mechanism.profile.registration": "datum"})
    found = cfmkit.analyze(spec)
    assert [found.values[f"registration_{name}"].value for name in ("angle", "x", "y")] == [0.0, 0.0, 0.0]
    u = parameters()
    normals = np.concatenate([flank.frame(u).normals for flank in flanks()])
    assert found.values["profile_mean"].value == pytest.approx(0.5e-3 * normals[:, 1].mean(), rel=0.02)
    assert not {"registration_weak", "width_error"} & {item.name for item in found.warnings}


def test_without_a_side_column_the_sign_of_x_tells_the_sides(tmp_path):
    points = measured(move=(0.0, np.zeros(2)))
    rows = [f"{x:.9f};{y:.9f}" for item in points for x, y in item * 1e3]
    (tmp_path / "measured.csv").write_text("x [mm];y [mm]\n" + "\n".join(rows) + "\n")
    found = cfmkit.analyze(spec_of(tmp_path, "0.000000001 mm"))
    assert found.values["profile_rmse"].value < 1e-11


def test_pictures_are_drawn(tmp_path):
    from cfmkit.api import figures

    found = built(tmp_path, Errors(waviness=0.01e-3, noise=0.002e-3))
    assert set(figures(found)) == {"loop", "profile", "shares"}
    assert all(draw().axes for draw in figures(found).values())


HOLES = {
    "both flanks": ([(0.08, 0.14), (0.08, 0.14)], (0.060, 0.115)),
    "one flank": ([(0.08, 0.14), (0.0, 0.0)], (0.060, 0.115)),
    "apart": ([(0.06, 0.07), (0.11, 0.12)], None),
}


@pytest.mark.parametrize(("cut", "hole"), HOLES.values(), ids=HOLES)
def test_a_part_of_a_flank_without_points_leaves_no_force_there(tmp_path, cut, hole):
    """It had been bridged by a smooth spline, and the share of the force error over it was given as measured."""
    points = measured(Errors(waviness=0.01e-3, noise=0.002e-3))
    write(
        tmp_path,
        [side[(side[:, 1] < low) | (side[:, 1] > high)] for side, (low, high) in zip(points, cut, strict=True)],
    )
    spec = spec_of(tmp_path).replace({"analysis.window": (0.04, 0.12)})
    found = cfmkit.analyze(spec)
    force = found.curve.select_branch("load")
    unknown = force.motion[~np.isfinite(force.effort)]
    if hole:
        assert (unknown.min(), unknown.max()) == (pytest.approx(hole[0], abs=2e-3), pytest.approx(hole[1], abs=2e-3))
        assert found.values["profile_coverage"].value == pytest.approx(
            1 - (unknown.max() - unknown.min()) / 0.08, abs=0.02
        )
    assert found.status.key == "partial"
    metrics = cfmkit.evaluate(found, ["force_ripple", "force_mean", "hysteresis_area"])
    assert all(item.value is None for item in metrics.values())
    for name in ("profile_force_share", "profile_force_sd", "loop_area_per_friction"):
        assert found.values[name].value is None
        assert "was not measured" in found.values[name].reason
    messages = {item.name: item.message for item in found.warnings}
    assert "up_jam" not in messages
    assert "is not known" in messages["profile_hole"]
    assert messages["part_measured"].count(" to ") == 1 + len(found.state.unmeasured_spans)


def test_a_hole_outside_the_window_and_a_small_one_do_not_matter(tmp_path):
    points = measured(Errors(waviness=0.01e-3, noise=0.002e-3))
    write(tmp_path, [side[(side[:, 1] < 0.03) | (side[:, 1] > 0.04)] for side in points])
    spec = spec_of(tmp_path).replace({"analysis.window": (0.04, 0.12), "requirements": ()})
    outside = cfmkit.analyze(spec)
    assert outside.status.key == "complete"
    assert outside.values["profile_force_share"].value is not None
    assert outside.values["profile_coverage"].value == 1.0
    write(tmp_path, [side[(side[:, 1] < 0.09) | (side[:, 1] > 0.0906)] for side in points])
    assert cfmkit.analyze(spec).status.key == "complete"
