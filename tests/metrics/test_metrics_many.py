"""Metrics of many curves, each a row, are those of each curve by itself."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import cfmkit
from cfmkit.curves import Column, Curve
from cfmkit.metrics import CycleRows, MeasuringFrame, Window, definitions, measure, metric_of_rows
from cfmkit.metrics.curve_rows import CurveRows, RowSamples, StressRows
from cfmkit.metrics.spread import Spread

COUNT, MOTION, DENSE = 40, np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 60)
PEAKS, SHIFTS = np.linspace(0.1, 0.9, 5), {"load": 0.2, "unload": -0.2}
FOLLOWED = replace(cfmkit.load("configs/cam_linear.yaml").target_curve, function=(10.0, 0.5))
ERRORS = np.where(np.arange(COUNT) % 10 == 2, 100.0, 1e-9)  # of some all effort is rounding


@dataclass
class Laws:
    """Efforts that rise, wave, start at zero or are constant: of some rows, or of one (a `ClosedForm`)."""

    wave: np.ndarray  # amplitude, frequency, slope, level, sign: (d, 1) each

    places, peaks = DENSE, PEAKS

    def row(self, k):
        return Laws(self.wave[:, k])

    def effort(self, branch, x, rows=slice(None)):
        amplitude, frequency, slope, level, sign = self.wave if self.wave.ndim == 2 else self.wave[:, rows]
        rise = np.minimum(1.0, level + 8.0 * x)
        return sign * (10.0 * rise * (1.0 + amplitude * np.sin(frequency * x) + slope * x) + SHIFTS[branch])

    def stress(self, _branch, x, rows=slice(None)):
        frequency = self.wave[1] if self.wave.ndim == 2 else self.wave[1][rows]
        return 5.0 + 10.0 * np.abs(np.sin(0.3 * frequency * np.asarray(x)))


def draw_laws(seed):
    draw = np.random.default_rng(seed)
    wave = np.stack([draw.uniform(low, high, (COUNT, 1)) for low, high in ((0, 0.12), (1, 40), (-0.1, 0.1), (0, 1))])
    wave[3, ::3], wave[0, 1::7], wave[2, 1::7] = 0.0, 0.0, 0.0
    return Laws(np.concatenate([wave, draw.choice([-1.0, 1.0], (1, COUNT, 1))]))


def rows_of(laws, branch, target, followed):
    """Return the laws as rows, of which the first has no allowable stress."""
    motion = np.broadcast_to(MOTION, (COUNT, len(MOTION)))
    allowable = np.where(np.arange(COUNT) == 0, np.nan, 12.0)
    stress = laws.stress(branch, motion)
    return CurveRows(
        RowSamples(motion, laws.effort(branch, motion), np.full(COUNT, len(MOTION))),
        lambda: np.broadcast_to(DENSE, (COUNT, len(DENSE))),
        lambda places, rows: laws.effort(branch, places, slice(None) if rows is None else rows),
        ERRORS, target, 0.05, (np.full(COUNT, 0.05), np.full(COUNT, 0.9)),
        lambda places: 3.0 + places,
        StressRows(
            lambda: [RowSamples(motion, stress, np.full(COUNT, len(MOTION)))],
            lambda places, rows: laws.stress(branch, places, rows), allowable,
        ),
        peaks=np.broadcast_to(PEAKS, (COUNT, len(PEAKS))), followed=followed,
    )  # fmt: skip


def measure_row(laws, k, window, target, followed):
    """Return all metrics of one law, whose unloading is stored backwards."""
    law = laws.row(k)
    path = np.concatenate([MOTION, MOTION[::-1]])
    effort = np.concatenate([law.effort("load", MOTION), law.effort("unload", MOTION)[::-1]])
    stress = {"max_stress": Column(law.stress("", path), "stress")}
    frame = MeasuringFrame(
        target, None, None if k == 0 else 12.0, valid=((0.05, 0.9),), closed=law, curve=followed,
        effort_error=ERRORS[k], part_efforts=lambda _branch, places: 3.0 + places,
    )  # fmt: skip
    curve = Curve(path, effort, np.repeat(["load", "unload"], len(MOTION)), np.ones(len(path), bool), stress)
    return measure(curve, frame, Window(*window) if window else None)


@pytest.mark.parametrize("followed", [None, FOLLOWED])
@pytest.mark.parametrize("target", [None, 10.0])
@pytest.mark.parametrize("window", [None, (0.21, 0.8), (-0.1, 0.8)])
def test_every_metric_of_many_curves_is_that_of_each(window, target, followed):
    laws = draw_laws(1)
    aim = np.full(COUNT, np.nan if target is None else target)
    ends = window and tuple(np.full(COUNT, end) for end in window)
    cycle = CycleRows.from_curves({name: rows_of(laws, name, aim, followed) for name in SHIFTS}, ends)
    alone = [measure_row(laws, k, window, target, followed) for k in range(COUNT)]
    for definition in (item for item in definitions("force") if not item.of_material):
        for branch, values in metric_of_rows(definition, cycle).items():
            name = f"{definition.name}[{branch}]" if branch else definition.name
            if definition.of_curve and followed is None:
                assert np.isnan(values).all()
                continue
            wanted = np.array([found[name].value for found in alone], float)
            # the ends of one curve are solved for one after the other, of many all at once
            np.testing.assert_allclose(values, wanted, rtol=3e-11, atol=1e-11, err_msg=name)


def spread_of(mean, largest, smallest):
    return tuple(item.tolist() for item in Spread.from_extremes(*map(np.array, (mean, largest, smallest, 0.0))))


def test_a_spread_is_judged_in_the_direction_of_its_mean():
    assert spread_of([-0.5, 0.5], [2.0, 2.0], [-3.0, -3.0]) == ([0.5, 0.5], [3.0, 2.0], [-2.0, -3.0], [-1.0, 1.0])


@pytest.mark.parametrize("mean", [-3e-16, 0.0, 3e-16])
def test_where_the_mean_is_zero_the_larger_extreme_says_the_direction(mean):
    """Over a full turn the rounding of the mean decided: a ripple of 197.5 or 202.6 % by the number of points."""
    assert spread_of([mean], [1.25], [-1.5]) == ([0.0], [1.5], [-1.25], [-1.0])
