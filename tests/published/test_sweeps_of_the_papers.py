"""Studies under configs/studies against what the papers and the closed forms say."""

import numpy as np
import pytest

import cfmkit
from cfmkit.studies.engine import run
from cfmkit.studies.sweep_request_and_files import SweepRequest, prepare, summary_of
from cfmkit.studies.tables import results_csv
from cfmkit.tables import read_csv

FOLDER = "configs/studies"


def swept(name, **changes):
    spec = cfmkit.load(f"{FOLDER}/{name}.yaml").replace(changes)
    records = run(prepare(spec, SweepRequest()))
    summary = summary_of(records)
    table = read_csv(b"".join(results_csv(records, summary.add)))
    return records, summary, table


def test_a_rest_length_error_costs_force_as_its_share_of_the_stretch():
    """Figure 4: F/F0 = 1 - d/D without friction; one step of the screw is d = 0.7 mm, -2.600 % at s = 40 mm."""
    changes = {"mechanism.rolling_friction": 0.0, "analysis.window": None}
    records, summary, _ = swept("cam_rest_length", **changes)
    assert summary.total == 5
    forces = []
    for indices, rows in records.batches():
        for k in range(len(indices)):
            table = read_csv(rows.curves[k])
            load = np.array(table["branch"]) == "load"
            forces.append(float(np.interp(40.0, table["displacement"][load], table["force"][load])))
    nominal = 4 * 1380 * 0.009058
    stretch = np.sqrt(2 * 0.009058 * 0.040)
    steps = np.array([-1.4, -0.7, 0.0, 0.7, 1.4]) * 1e-3
    assert forces == pytest.approx(nominal * (1 - steps / stretch), rel=1e-6)
    assert forces[3] / nominal - 1 == pytest.approx(-0.02600, abs=5e-6)


def test_the_edge_of_the_undercut_is_where_the_curvature_says():
    """The published cam, A = 9.058 mm, fits rollers up to 10.33 mm; a 16 mm roller needs A >= 14.46 mm."""
    _, summary, table = swept("cam_radius_and_constant")
    assert summary.counts.total() == 29 * 21
    radius, constant = table["mechanism.roller_radius"], table["mechanism.profile.force_constant"]
    undercut = np.array(table["undercut_travel"]) > 0
    fits = radius[~undercut & (constant == 9.0)]
    assert fits.max() == 10.0
    assert radius[undercut & (constant == 9.0)].min() == 10.5
    needs = constant[~undercut & (radius == 16.0)]
    assert needs.min() == 14.5
