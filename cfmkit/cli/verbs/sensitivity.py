"""``cfmkit sensitivity``: the influence of values on metrics, and the yield."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from cfmkit.cli import options as shell_completion
from cfmkit.cli.options import StudyOptions, flag, option
from cfmkit.errors import ExitCode, UsageError
from cfmkit.specs.sensitivity_methods import MethodWord, describe_methods, describe_samples

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from matplotlib.figure import Figure

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document
    from cfmkit.specs.spec import Spec
    from cfmkit.studies.sensitivity.result_types import Findings

HELP_POSITION = 24
HELP_EXAMPLE = (
    "cfmkit sensitivity cam.yaml --method tolerance --vary mechanism.roller_radius=normal:0.05mm --samples 400"
)


@dataclass(frozen=True, kw_only=True)
class SensitivityOptions(StudyOptions):
    """Arguments and options."""

    method: MethodWord | None = option("NAME", f"{describe_methods()}; default: the spec's, else oat.")
    samples: int | None = option("N", f"{describe_samples()}.", low=2)
    seed: int | None = option("N", "Seed of all random numbers; default: the spec's, else 0.", low=0)  # type: ignore[assignment]
    vary: list[str] | None = option(
        "A.B=SPREAD",
        "A parameter: low:high, normal:DEVIATION or uniform:HALF-WIDTH, e.g. "
        "mechanism.width=uniform:2%. Repeatable; replaces the spec's parameters.",
        autocompletion=shell_completion.changes,
    )
    metrics: str | None = option("A,B", "Metrics to study; default: those of the requirements, over their windows.")
    design: bool = flag("Redesign the mechanism at each sample.")


def run(options: SensitivityOptions, terminal: Terminal) -> Document:
    """Find out which values matter most, and which share of manufactured parts will meet the requirements.

    The spec's block `sensitivity` says what is uncertain. Finished samples are kept in the folder: after an
    interruption, run the same command again to continue.
    """
    from cfmkit.cli.run_study_in_folder import open_study
    from cfmkit.documents.study_documents import sensitivity_document
    from cfmkit.runs.run import RunTask, placing, read
    from cfmkit.studies.sensitivity.run_and_files import as_json, carry_out, outputs
    from cfmkit.studies.sensitivity.setup import prepare

    start = time.perf_counter()
    document, spec = read(RunTask(options.spec, "", options.changes, options.fidelity))
    with placing(document, [f"sensitivity.{key}" for key in changes_of(options)]):
        setup = prepare(changed_by(options, spec), options.seed, options.max_points)
    with open_study("sensitivity", options, terminal, start) as study:
        study.folder.check("results.csv", "indices.csv", "metrics.json", "resolved.yaml")
        findings = replace(carry_out(setup, study.compute), fresh=options.fresh)
        tables = study.write_tables(outputs(findings))
        page = sensitivity_document(findings)
        study.write_pages(page, setup.study, findings.setup.paths, tables, partial(_pictures, findings))
        data, pieces = as_json(findings), [piece.records for piece in findings.evaluator.pieces]
        finished = study.commit(page, setup.study, setup.seed, pieces, data)
    return replace(finished, quiet_complaints=tuple(_essential_complaints(findings, data, page.exit_code)))


def _pictures(findings: Findings) -> Mapping[str, Callable[[], Figure]]:
    """Return what draws the pictures of a study; nothing of one that was not finished."""
    from cfmkit.plots.sensitivity import figures

    return {} if findings.interrupted else figures(findings)


def changed_by(options: SensitivityOptions, spec: Spec) -> Spec:
    """Return a spec with what the options say about its block `sensitivity`.

    Raises UsageError if an option is malformed; SpecError if the block is not valid with it.
    """
    from cfmkit.studies.parts.uncertain_values import with_options

    changes = changes_of(options)
    if not changes or (spec.sensitivity is None and "parameters" not in changes):
        return spec
    if spec.sensitivity is not None and any(map(_sets_samples, options.changes)):
        changes = {"samples": spec.sensitivity.samples} | changes
    return spec.replace({"sensitivity": with_options(spec.sensitivity, changes)})


def _sets_samples(change: str) -> bool:
    """Return True if a ``--set`` states the number of samples, which then does not follow from the method."""
    return change.partition("=")[0].rpartition(":")[2].strip() in ("sensitivity", "sensitivity.samples")


def changes_of(options: SensitivityOptions) -> dict[str, Any]:
    """Return what the options say, by key of the block."""
    from cfmkit.cli.run_study_in_folder import split_names

    said = {
        "method": options.method,
        "samples": options.samples,
        "parameters": dict(map(spread, options.vary)) if options.vary else None,
        # What the spec says goes together names parameters that may not be there any more.
        "correlated": () if options.vary else None,
        "metrics": split_names(options.metrics) or None,
        "design": options.design or None,
    }
    return {key: value for key, value in said.items() if value is not None}


def spread(option: str) -> tuple[str, Any]:
    """Return (path, range or tolerance) of ``--vary``.

    Raises UsageError if it is neither.
    """
    path, equals, text = (part.strip() for part in option.partition("="))
    first, colon, second = (part.strip() for part in text.partition(":"))
    if not (path and equals and colon and first and second) or ":" in second:
        reported = "write PATH=low:high, PATH=normal:DEVIATION or PATH=uniform:HALF-WIDTH, with units"
        raise UsageError(f"--vary {option!r}: {reported}")
    return path, {first: second} if first in ("normal", "uniform") else (first, second)


def _essential_complaints(findings: Findings, data: Mapping[str, Any], code: ExitCode) -> Iterator[str]:
    """Yield what a user must hear who has asked to hear nothing else."""
    from cfmkit.studies.sensitivity.run_and_files import message

    if code not in (ExitCode.OK, ExitCode.REQUIREMENT_MISSED):
        yield f"{data['status']:<9}{message(findings)}"
    for requirement in data["requirements"]:
        if not requirement["ok"]:
            yield f"missed   {requirement['sentence'].removesuffix(': missed')}"
