"""What the pictures of a sweep show: its values in their units, its best point, names of what varied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cfmkit
from cfmkit.studies.engine import run
from cfmkit.studies.pictures import _nominal, study_marks
from cfmkit.studies.sweep_request_and_files import SweepRequest, prepare, summary_of
from cfmkit.studies.variations import collect_variations
from cfmkit.tables import Table, TableColumn

WIDTHS = {"mechanism.contact.width": ("8 mm", "9 mm", "10 mm")}  # which change no force


def swept(spec, vary, *names):
    """Return the rows of a sweep, and its summary without any."""
    records = run(prepare(spec, SweepRequest(vary=collect_variations(vary), metrics=names or ("force_ripple",))))
    return records, summary_of(records)


def add_all(summary, records, at_once=None):
    for batch in records.batches(*([] if at_once is None else [at_once])):
        summary.add(*batch)


def test_shares_are_drawn_in_per_cent_as_the_page_has_them():
    spec = cfmkit.load("configs/cam.yaml").replace({"requirements": ()})
    records, summary = swept(spec, {"mechanism.rolling_friction": (0.001, 0.002)}, "force_ripple", "force_mean")
    add_all(summary, records)
    ripple = next(one for one in study_marks(records, summary).metrics if one.name == "force_ripple")
    assert ripple.label == "force ripple [%]"
    assert ripple.values == pytest.approx(100 * summary.kept[0][1][:, 0])


def test_points_that_are_as_good_as_the_best_are_counted():
    records, summary = swept(cfmkit.load("configs/cam.yaml"), WIDTHS)
    add_all(summary, records, 1)  # one at a time: ties are counted across batches
    assert (summary.best, summary.ties) == (0, 3)
    assert summary.as_json(records)["best"]["ties"] == 3


@pytest.mark.parametrize("at_once", [1, 3])
def test_of_points_that_only_rounding_tells_apart_the_first_is_the_best(at_once):
    records, summary = swept(cfmkit.load("configs/cam.yaml"), WIDTHS)
    for indices, rows in records.batches(at_once):
        rounding = 1.0 - 1e-13 * np.asarray(indices)[:, None]
        summary.add(indices, replace(rows, values=rows.values * rounding))
    assert (summary.best, summary.ties) == (0, 3)


def test_the_nominal_curve_is_read_in_one_pass_over_the_cells(monkeypatch):
    """Cells of a column are made once: once a row took 28 times the time of the study."""
    rows = 500
    columns = ("preload", "branch", "displacement", "force", "more")
    values = [0.0] * rows, ["load"] * rows, list(range(rows)), [1.0] * rows, [2.0] * rows
    table = Table(tuple(TableColumn(name, tuple(one)) for name, one in zip(columns, values, strict=True)))
    calls, plain = [], TableColumn.cells
    monkeypatch.setattr(TableColumn, "cells", lambda self: calls.append(self.name) or plain(self))
    nominal = _nominal(table)
    assert len(nominal) == rows
    assert len(calls) <= len(columns)
