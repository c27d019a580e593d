"""Functions of ``import cfmkit`` for recordings: metrics, models fitted to them, designs corrected by them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from cfmkit.api import resolve
from cfmkit.errors import UsageError
from cfmkit.metrics import Window
from cfmkit.runs.values_with_units import read_target, read_window

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from cfmkit.api import AnySpec
    from cfmkit.experiment.calibration import Calibration
    from cfmkit.experiment.correction import DesignCorrection
    from cfmkit.experiment.corrections_and_low_pass import LowPass
    from cfmkit.experiment.curves_and_metrics_of_recording import MeasuredCurves
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport
    from cfmkit.experiment.reading import Recording
    from cfmkit.numerics.least_squares import Loss


def measure(
    data: str | os.PathLike[str] | Recording,
    *,
    units: str | None = None,
    window: str | tuple[float, float] | None = None,
    filter: str = "default",
    target: str | float | None = None,
    tare: str | float | None = None,
    zero: str | float | None = None,
    flip: str | Iterable[str] = (),
    as_recorded: bool = False,
    one_branch: bool = False,
    cycles: str | None = None,
    group: str | None = None,
    max_hole: str | float | None = None,
) -> MeasureReport:
    """Return what a measured force curve says: branches, metrics raw and filtered, hysteresis, repeatability.

    Parameters
    ----------
    data : path-like or Recording
        A lab file with displacement and force, or angle and torque, perhaps time; or the arrays themselves.
    units : str, optional
        Units that the header does not name: ``"s=mm,F=N"``.
    window : str or (float, float), optional
        Where to measure: ``"40 mm:210 mm"``, or numbers in m or rad. Default: all that every branch covers.
    filter : str
        Low-pass of each branch: ``"2 Hz"``, ``"0.24 1/mm, order 3"``, ``"2 Hz, corrected"`` or ``"none"``.
    target : str or float, optional
        Force [N] or torque [N m] that it should have.
    tare, zero : str or float, optional
        What the sensors show without load [N or N m] and at the mechanism's zero [m or rad]; ``"start"``: at first.
    flip : str or iterable of str
        ``"force"``, ``"displacement"``, ``"torque"``, ``"angle"``: what is recorded with the sign reversed.
    as_recorded : bool
        Leave out neither spikes nor points next to reversals.
    one_branch : bool
        Accept a recording without a return stroke.
    cycles : str, optional
        Which cycles: ``"2:5"``. Default: the complete ones of full travel.
    group : str, optional
        Which specimen of several: ``"Specimen=2"``; ``"none"``: all rows are of one.
    max_hole : str or float, optional
        Part of the window that may be missing in one piece; default: 2 %. With a larger hole metrics have no value.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read, or an option is malformed.
    cfmkit.errors.DataError
        If it holds no curve, those of several specimens, or the window was not measured.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.measure("configs/synthetic/cam_loop.csv", window="40 mm:120 mm", filter="2 Hz")
    >>> round(found.numbers.filtered["force_mean[load]"].value, 2)
    50.46
    """
    from cfmkit.experiment.reading import Recording, read_recording

    recording = data if isinstance(data, Recording) else read_recording(_require_path(data), units, group)
    options = MeasurementSettings(
        window, filter, target, tare, zero, _as_tuple(flip), as_recorded, one_branch, cycles, max_hole
    )
    return options.report_on(recording)


def measure_each(
    data: str | os.PathLike[str], units: str | None, group: str | None, how: MeasurementSettings
) -> dict[str, MeasureReport]:
    """Return what the measured curve of each specimen of a file says, by specimen."""
    from cfmkit.experiment.reading import read_recordings

    return {
        name: how.report_on(recording) for name, recording in read_recordings(_require_path(data), units, group).items()
    }


@dataclass(frozen=True)
class MeasurementSettings:
    """Settings of a measurement; the fields are as for `measure`."""

    window: str | tuple[float, float] | None = None
    filter: str = "default"
    target: str | float | None = None
    tare: str | float | None = None
    zero: str | float | None = None
    flip: tuple[str, ...] = ()
    as_recorded: bool = False
    one_branch: bool = False
    cycles: str | None = None
    max_hole: str | float | None = None

    def report_on(self, recording: Recording) -> MeasureReport:
        """Return what a recording says."""
        from cfmkit.experiment.branches import read_cycles
        from cfmkit.experiment.corrections_and_low_pass import correct_recording, read_filter
        from cfmkit.experiment.curves_and_metrics_of_recording import LEFT_OUT, measure_recording, require_loop
        from cfmkit.experiment.measurement_and_calibration_outputs import report_on
        from cfmkit.experiment.recorded_values import read_largest_hole
        from cfmkit.metrics import MeasuringFrame

        low_pass: LowPass | Literal["default"] | None
        low_pass = "default" if self.filter == "default" else read_filter(self.filter)
        cycles, largest = read_cycles(self.cycles), read_largest_hole(self.max_hole)
        place = read_window(self.window, recording.kind)
        frame = MeasuringFrame(target=read_target(self.target, recording.kind))
        recording = correct_recording(recording, self.tare, self.zero, self.flip)
        source = measure_recording(recording, low_pass, () if self.as_recorded else LEFT_OUT, cycles)
        if not self.one_branch:
            require_loop(source)
        return report_on(source, frame, place, largest)


def _require_path(data: str | os.PathLike[str]) -> str:
    """Return the path of a file, if it is one."""
    if isinstance(data, str | os.PathLike):
        return str(os.fspath(data))
    raise UsageError(f"the path of a data file or a cfmkit.Recording of arrays is needed, not {type(data).__name__}")


def _as_tuple(names: str | Iterable[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def calibrate(
    spec: AnySpec,
    data: str | os.PathLike[str] | Recording | MeasuredCurves,
    fit: str | Sequence[str],
    *,
    bounds: Mapping[str, str | tuple[float, float]] | None = None,
    loss: Loss = "soft_l1",
    window: tuple[float, float] | None = None,
    units: str | None = None,
    tare: str | float | None = None,
    zero: str | float | None = None,
    flip: str | Iterable[str] = (),
    cycles: str | None = None,
    group: str | None = None,
) -> Calibration:
    """Return a specification whose model fits a measured curve: values, intervals, and what the data cannot determine.

    Parameters
    ----------
    spec : Spec or path-like
        Its values are the start; derived parts are written out first and keep their shape.
    data : path-like, Recording or MeasuredCurves
        A lab file as for `measure`, or what was read of it.
    fit : str or sequence of str
        Dotted paths of numbers of the specification; ``data.force_offset``, ``data.displacement_offset`` and
        ``data.drift`` are zeros of the recording.
    bounds : mapping, optional
        Path -> ``"low:high"`` with units, or two numbers in SI units.
    loss : {"soft_l1", "linear", "huber", "cauchy"}
        How large errors count.
    window : (float, float), optional
        Where to compare [m or rad]; default: ``analysis.window``.
    units, tare, zero, flip, cycles, group
        As for `measure`.

    Raises
    ------
    cfmkit.errors.UsageError
        If the file cannot be read, or there is nothing to fit at a path.
    cfmkit.errors.DataError
        If the data hold no curve, or one that cannot be compared.
    cfmkit.errors.SolutionError
        If the start has no solution, or the data do not determine the values.

    Examples
    --------
    >>> import cfmkit
    >>> spec = cfmkit.load("configs/cam.yaml", ["analysis.window=[40 mm, 120 mm]"])
    >>> found = cfmkit.calibrate(spec, "configs/synthetic/cam_loop.csv", "mechanism.rolling_friction")
    >>> round(found.spec.mechanism.rolling_friction, 5)
    0.00224
    """
    from cfmkit.experiment.calibration import calibrate as fitted
    from cfmkit.experiment.parameters_to_fit import parameters, read_bounds
    from cfmkit.numerics.least_squares import LOSS_NAMES

    if loss not in LOSS_NAMES:
        raise UsageError(f"--loss: there is no {loss!r}; there are {', '.join(LOSS_NAMES)}")
    start = resolve(spec)
    source = _read_curves(data, units, tare, zero, flip, cycles, group)
    limits_by_path = bounds or {}
    texts = [f"{path}={ends}" for path, ends in limits_by_path.items() if isinstance(ends, str)]
    numbers = {path: ends for path, ends in limits_by_path.items() if not isinstance(ends, str)}
    limits = read_bounds(texts, start, source.recording) | numbers
    paths = fit.split(",") if isinstance(fit, str) else fit
    chosen = parameters(start, paths, limits, source.recording)
    return fitted(start, source, chosen, loss, Window(*window) if window else None)


def correct(
    spec: AnySpec,
    data: str | os.PathLike[str] | Recording | MeasuredCurves,
    *,
    fit: str | Sequence[str] | None = None,
    units: str | None = None,
    tare: str | float | None = None,
    zero: str | float | None = None,
    flip: str | Iterable[str] = (),
    cycles: str | None = None,
    group: str | None = None,
) -> DesignCorrection:
    """Return a design corrected by the recording of a part that was made of it.

    Parameters
    ----------
    spec : Spec or path-like
        What the part was made of.
    data : path-like, Recording or MeasuredCurves
        A lab file as for `measure`, or what was read of it.
    fit : str or sequence of str, optional
        What errs in the part; default: whichever of modulus, thickness, friction and rates the recording tells apart.
    units, tare, zero, flip, cycles, group
        As for `measure`. Without `tare` the zero of the force is fitted where the recording tells it.

    Raises
    ------
    cfmkit.errors.DataError
        If the recording is not of such a part.
    cfmkit.errors.SolutionError
        If it determines nothing, or no part that can be made has the force.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.correct("configs/cam.yaml", "configs/synthetic/cam_loop.csv", tare="0 N")
    >>> found.changes  # within the scatter: nothing to correct
    {}
    """
    from cfmkit.experiment.correction import correct as correct_design

    source = _read_curves(data, units, tare, zero, flip, cycles, group)
    paths = fit.split(",") if isinstance(fit, str) else fit
    return correct_design(resolve(spec), source, paths, tare is not None)


def _read_curves(
    data: str | os.PathLike[str] | Recording | MeasuredCurves,
    units: str | None,
    tare: str | float | None,
    zero: str | float | None,
    flip: str | Iterable[str],
    cycles: str | None,
    group: str | None,
) -> MeasuredCurves:
    """Return the branches of a recording, read from its file unless they are given."""
    from cfmkit.experiment.branches import read_cycles
    from cfmkit.experiment.corrections_and_low_pass import correct_recording
    from cfmkit.experiment.curves_and_metrics_of_recording import (
        LEFT_OUT,
        MeasuredCurves,
        measure_recording,
        read_measured,
    )
    from cfmkit.experiment.reading import Recording

    if isinstance(data, MeasuredCurves):
        return data
    if isinstance(data, Recording):
        return measure_recording(
            correct_recording(data, tare, zero, _as_tuple(flip)), None, LEFT_OUT, read_cycles(cycles)
        )
    return read_measured(_require_path(data), units, tare, zero, _as_tuple(flip), cycles, group)
