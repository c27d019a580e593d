"""cfmkit: design and analysis of constant-force mechanisms.

    import cfmkit

    spec = cfmkit.load("cam.yaml")
    result = cfmkit.analyze(spec)
    result.curve.force

Arrays are read-only and in SI units. The names below are imported when they are
first used, so that ``import cfmkit`` itself costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from cfmkit._version import __version__

if TYPE_CHECKING:
    from cfmkit.api import (
        analyze,
        check,
        design,
        drawing,
        dumps,
        evaluate,
        export,
        figures,
        load,
        loads,
    )
    from cfmkit.curves import Curve
    from cfmkit.errors import (
        CfmError,
        DataError,
        ExitCode,
        FolderInUse,
        GeometryError,
        InputError,
        OutputError,
        Problem,
        QuantityError,
        SolutionError,
        SpecError,
        UsageError,
    )
    from cfmkit.experiment.measurement_and_calibration_outputs import MeasureReport
    from cfmkit.experiment.reading import Recording
    from cfmkit.families.run_control import Run
    from cfmkit.results import Design, Finding, Quantity, Result, Status
    from cfmkit.runs.batch import BatchResult, batch
    from cfmkit.runs.examples import Example, examples
    from cfmkit.runs.measure_and_calibrate_api import calibrate, correct, measure
    from cfmkit.runs.notebook_result import AnalysisView
    from cfmkit.runs.register import metric, register
    from cfmkit.runs.study_result import StudyResult
    from cfmkit.runs.suggest_api import suggest
    from cfmkit.runs.sweep_and_sensitivity_api import sensitivity, sweep
    from cfmkit.specs.spec import Spec

_NAMES_OF_MODULE = {
    "cfmkit.api": (
        "analyze",
        "check",
        "design",
        "drawing",
        "dumps",
        "evaluate",
        "export",
        "figures",
        "load",
        "loads",
    ),
    "cfmkit.runs.batch": ("BatchResult", "batch"),
    "cfmkit.runs.examples": ("Example", "examples"),
    "cfmkit.curves": ("Curve",),
    "cfmkit.errors": (
        "CfmError",
        "DataError",
        "ExitCode",
        "FolderInUse",
        "GeometryError",
        "InputError",
        "OutputError",
        "Problem",
        "QuantityError",
        "SolutionError",
        "SpecError",
        "UsageError",
    ),
    "cfmkit.experiment.reading": ("Recording",),
    "cfmkit.experiment.measurement_and_calibration_outputs": ("MeasureReport",),
    "cfmkit.families.run_control": ("Run",),
    "cfmkit.runs.measure_and_calibrate_api": ("calibrate", "correct", "measure"),
    "cfmkit.runs.notebook_result": ("AnalysisView",),
    "cfmkit.results": ("Design", "Finding", "Quantity", "Result", "Status"),
    "cfmkit.specs.spec": ("Spec",),
    "cfmkit.runs.register": ("metric", "register"),
    "cfmkit.runs.study_result": ("StudyResult",),
    "cfmkit.runs.suggest_api": ("suggest",),
    "cfmkit.runs.sweep_and_sensitivity_api": ("sensitivity", "sweep"),
}
_MODULE_OF_NAME = {name: module for module, names in _NAMES_OF_MODULE.items() for name in names}

__all__ = [
    "AnalysisView",
    "BatchResult",
    "CfmError",
    "Curve",
    "DataError",
    "Design",
    "Example",
    "ExitCode",
    "Finding",
    "FolderInUse",
    "GeometryError",
    "InputError",
    "MeasureReport",
    "OutputError",
    "Problem",
    "Quantity",
    "QuantityError",
    "Recording",
    "Result",
    "Run",
    "SolutionError",
    "Spec",
    "SpecError",
    "Status",
    "StudyResult",
    "UsageError",
    "__version__",
    "analyze",
    "batch",
    "calibrate",
    "check",
    "correct",
    "design",
    "drawing",
    "dumps",
    "evaluate",
    "examples",
    "export",
    "figures",
    "load",
    "loads",
    "measure",
    "metric",
    "register",
    "sensitivity",
    "suggest",
    "sweep",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first needed."""
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module 'cfmkit' has no attribute {name!r}")
    value = getattr(import_module(_MODULE_OF_NAME[name]), name)
    globals()[name] = value
    return value


class _Package(ModuleType):
    """The package `cfmkit`, whose `export` stays a function when the package of that name is imported."""

    @property
    def export(self) -> Any:
        """The function `cfmkit.api.export`."""
        return import_module("cfmkit.api").export

    @export.setter
    def export(self, package: ModuleType) -> None:
        """Ignore the package: the import system sets it as an attribute, but it is found without that."""


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*globals(), *__all__})
