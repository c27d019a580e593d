"""Studies under configs/studies against what the papers and the closed forms say."""

import numpy as np
import pytest

import cfmkit

FOLDER = "configs/studies"


def test_a_rest_length_error_costs_force_as_its_share_of_the_stretch():
    """Figure 4: F/F0 = 1 - d/D without friction; one step of the screw is d = 0.7 mm, -2.600 % at s = 40 mm."""
    changes = {"mechanism.rolling_friction": 0.0, "analysis.window": None}
    curves = cfmkit.sweep(cfmkit.load(f"{FOLDER}/cam_rest_length.yaml").replace(changes)).curves
    varied, load = curves["mechanism.rest_half_width"], np.array(curves["branch"]) == "load"
    at = [load & (varied == value) for value in np.unique(varied)]
    assert len(at) == 5
    forces = [float(np.interp(40.0, curves["displacement"][own], curves["force"][own])) for own in at]
    nominal = 4 * 1380 * 0.009058
    stretch = np.sqrt(2 * 0.009058 * 0.040)
    steps = np.array([-1.4, -0.7, 0.0, 0.7, 1.4]) * 1e-3
    assert forces == pytest.approx(nominal * (1 - steps / stretch), rel=1e-6)
    assert forces[3] / nominal - 1 == pytest.approx(-0.02600, abs=5e-6)


def test_the_edge_of_the_undercut_is_where_the_curvature_says():
    """The published cam, A = 9.058 mm, fits rollers up to 10.33 mm; a 16 mm roller needs A >= 14.46 mm."""
    table = cfmkit.sweep(f"{FOLDER}/cam_radius_and_constant.yaml").table
    assert len(table["force_ripple"]) == 29 * 21
    radius, constant = table["mechanism.roller_radius"], table["mechanism.profile.force_constant"]
    undercut = np.array(table["undercut_travel"]) > 0
    fits = radius[~undercut & (constant == 9.0)]
    assert fits.max() == 10.0
    assert radius[undercut & (constant == 9.0)].min() == 10.5
    needs = constant[~undercut & (radius == 16.0)]
    assert needs.min() == 14.5
