"""What the beam family tells of vibration and of stiffness across the drive: columns, metrics, findings, faults."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import cantilever, solved, value, warned

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families.beam.figures import figures

DENSITY = 1200.0
WEIGHS = ("yield_strength: 50 MPa", "yield_strength: 50 MPa, density: 1200 kg/m^3")
MODES = ("points: 21", "points: 21\n  modes: 3")
UNIT = np.sqrt(0.02 / (DENSITY * 1e-4 * 0.4**4)) / (2 * np.pi)
"""EI = 0.02 N m^2, 0.12 kg/m, L = 0.4 m: a frequency is beta^2 times this [Hz]."""

FOLLOWED = (
    (
        "{kind: displacement, node: tip, direction: -90 deg}",
        "{kind: force, node: tip, direction: 180 deg, follows: true}",
    ),
    ("travel: 100 mm\n  points: 21", "force: 2.6 N\n  points: 53"),
)
"""Beck's column."""


def test_frequencies_are_columns_held_and_free():
    result = cfmkit.analyze(cantilever(WEIGHS, MODES))
    extra = result.curve.extra
    betas = {"free": [1.87510407, 4.69409113, 7.85475744], "held": [3.92660231, 7.06858275, 10.21017612]}
    for name, known in betas.items():
        found = [extra[f"frequency_{k}_{name}"].values[0] for k in (1, 2, 3)]
        np.testing.assert_allclose(found, UNIT * np.array(known) ** 2, rtol=1e-6)
    assert extra["frequency_1_held"].dimension == "frequency"
    assert value(result, "frequency_free_min") == extra["frequency_1_free"].values.min()
    assert value(result, "frequency_held_min") == extra["frequency_1_held"].values.min()


def test_without_modes_there_are_no_columns_and_no_metrics():
    result = cfmkit.analyze(cantilever(WEIGHS))
    assert not [name for name in result.curve.extra if name.startswith("frequency")]
    assert result.values["frequency_held_min"].value is None


def test_frequencies_are_empty_where_a_pose_is_unstable():
    """Lan's mechanism under a force snaps: the falling part is stable while the drive is held, not while it is free."""
    result = solved("beam_lan2010", "analysis.points=28", "analysis.modes=1", "mechanism.material=pom")
    falling = np.gradient(result.curve.force, result.curve.motion) < -1.0
    held, free = (result.curve.extra[f"frequency_1_{name}"].values for name in ("held", "free"))
    assert falling.any()
    assert np.isfinite(held).all()
    assert np.isnan(free[falling]).all()
    assert np.isfinite(free[:15]).all()
    assert value(result, "frequency_free_min") is None


def test_a_mass_at_a_node_lowers_them():
    """So heavy that the beam counts with 33/140 of its mass at the tip [Rayleigh]."""
    heavy = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], mass: 2 kg}")
    result = cfmkit.analyze(cantilever(WEIGHS, MODES, heavy))
    swinging = 2 + 33 / 140 * 0.12 * 0.4
    wanted = np.sqrt(3 * 0.02 / 0.4**3 / swinging) / (2 * np.pi)
    assert result.curve.extra["frequency_1_free"].values[0] == pytest.approx(wanted, rel=1e-4)


def test_legs_and_halves_swing_as_one():
    """Masses at nodes are those of one copy: so are the stiffnesses."""
    one = cfmkit.analyze(cantilever(WEIGHS, MODES))
    legs = ("drive: {kind", "copies: {legs: 3}\n  drive: {kind")
    three = cfmkit.analyze(cantilever(WEIGHS, MODES, legs))
    for name in ("frequency_1_held", "frequency_1_free"):
        np.testing.assert_array_equal(one.curve.extra[name].values, three.curve.extra[name].values)


def test_stages_in_series_weigh_what_one_does_each():
    result = solved("beam_two_layers", "analysis.points=5", "analysis.modes=2", "mechanism.material=pom")
    assert np.isfinite(result.curve.extra["frequency_2_held"].values[:2]).all()


def test_a_named_material_has_its_density():
    result = cfmkit.analyze(cantilever(("{youngs_modulus: 2.4 GPa, yield_strength: 50 MPa}", "pom"), MODES))
    assert np.isfinite(result.curve.extra["frequency_1_held"].values).all()
    assert result.spec.mechanism.material.density == 1410.0


def test_a_missing_density_is_told_with_its_key():
    with pytest.raises(SpecError) as caught:
        cantilever(MODES)
    assert "analysis.modes" in str(caught.value)
    assert "give mechanism.material.density" in str(caught.value)
    own = ("end: tip}", "end: tip, material: {youngs_modulus: 1 GPa}}")
    with pytest.raises(SpecError, match=r"give mechanism\.beams\.beam\.material\.density"):
        cantilever(WEIGHS, MODES, own)


def test_frequencies_have_a_picture():
    assert "frequencies" in figures(cfmkit.analyze(cantilever(WEIGHS, MODES)))
    assert "frequencies" not in figures(cfmkit.analyze(cantilever(WEIGHS)))


def test_becks_column_is_said_to_flutter_at_its_load():
    """20.051 EI/L^2 = 2.506 N: points are 0.05 N apart."""
    result = cfmkit.analyze(cantilever(WEIGHS, *FOLLOWED))
    assert "flutter_not_judged" not in warned(result)
    assert "2.55 N" in warned(result)["flutter"]
    assert (result.curve.stable == (result.curve.force < 2.5064)).all()
    bad = int((~result.curve.stable).sum())
    assert warned(result)["unstable"].startswith(f"{bad} of {len(result.curve.stable)} points are not stable")


def test_without_a_density_flutter_is_not_judged():
    result = cfmkit.analyze(cantilever(*FOLLOWED))
    assert "density" in warned(result)["flutter_not_judged"]
    assert result.curve.stable.all()


def test_stiffness_across_is_a_metric_and_a_column():
    """Of a guided beam pushed along itself by next to nothing: 12 EI/L^3 for each leg."""
    text = (
        "drive: {kind: displacement, node: tip, direction: -90 deg}",
        "copies: {legs: 2}\n  drive: {kind: force, node: tip, direction: 180 deg}",
    )
    guided = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: guided, direction: 0 deg}")
    small = ("travel: 100 mm", "force: 1e-6 N\n  outputs: {cross_stiffness: true}")
    result = cfmkit.analyze(cantilever(text, guided, small))
    wanted = 2 * 12 * 0.02 / 0.4**3
    column = result.curve.extra["cross_stiffness"]
    assert column.dimension == "stiffness"
    np.testing.assert_allclose(column.values, wanted, rtol=1e-5)
    assert value(result, "cross_stiffness") == pytest.approx(wanted, rel=1e-5)


PRESSED = (
    ("2.4 GPa", "200 GPa"), ("thickness: 1 mm", "thickness: 2 mm"), ("width: 100 mm", "width: 10 mm\n  axial: true"),
    ("400 mm", "100 mm"), ("direction: -90 deg", "direction: 180 deg"), ("travel: 100 mm", "travel: 0.1 mm"),
    ("points: 21", "points: 41\n  branch: primary\n  outputs: {cross_stiffness: true}"),
)  # fmt: skip


def test_stiffness_across_an_unstable_column_has_a_pole_where_it_would_buckle_with_its_tip_held():
    """Under a thrust P it is P / (tan(n L)/n - L), n^2 = P/EI: unbounded at n L = 4.4934, Euler's third case."""
    result = cfmkit.analyze(cantilever(*PRESSED))
    bending, length = 200e9 * 10e-3 * 2e-3**3 / 12, 0.1
    thrust, column = result.curve.effort[4:24], result.curve.extra["cross_stiffness"].values[4:24]
    n = np.sqrt(thrust / bending)
    np.testing.assert_allclose(column, thrust / (np.tan(n * length) / n - length), rtol=2e-2)
    assert value(result, "cross_stiffness") is None
    below = cfmkit.analyze(cantilever(*PRESSED, ("points: 41", "points: 41\n  window: [0.01 mm, 0.05 mm]")))
    assert -27e3 < value(below, "cross_stiffness") < -25e3


def test_the_metric_of_stiffness_across_is_the_smallest_in_the_window():
    window = ("points: 21", "points: 21\n  window: [20 mm, 60 mm]\n  outputs: {cross_stiffness: true}")
    result = cfmkit.analyze(cantilever(window))
    inside = (result.curve.motion > 0.0199) & (result.curve.motion < 0.0601)
    values = result.curve.extra["cross_stiffness"].values
    assert value(result, "cross_stiffness") == values[inside].min() != np.nanmin(values)


def test_a_drive_that_turns_has_nothing_across():
    turned = ("{kind: displacement, node: tip, direction: -90 deg}", "{kind: rotation, node: tip}")
    travel = ("travel: 100 mm", "travel: 10 deg")
    assert cfmkit.analyze(cantilever(turned, travel)).values["cross_stiffness"].value is None
    with pytest.raises(SpecError, match="no direction, and so no stiffness across it"):
        cantilever(turned, travel, ("points: 21", "points: 21\n  outputs: {cross_stiffness: true}"))
