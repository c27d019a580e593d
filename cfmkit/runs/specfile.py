"""Specifications on their way in: read from a file or standard input, changed by options, checked by their family."""

from __future__ import annotations

import difflib
import glob
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit.errors import Problem, SpecError, UsageError, reason_of, visible
from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cfmkit.families.base import Family
    from cfmkit.specs.spec import Requirement, Spec
    from cfmkit.specs.yamlio import YamlDocument

STDIN_PATH = "-"


def read_spec(
    name: str,  # path of a YAML file; ``-`` is standard input
    changes: Iterable[str] = (),  # what ``--set`` takes
    of_many: bool = False,  # whether there are other specifications, for which some options may be
) -> YamlDocument:
    """Return what a file says, changed by options such as ``a.b=1 mm``; nothing is checked yet.

    Raises UsageError if the file cannot be read, or an option is malformed or for a specification of another family.
    """
    from cfmkit.specs.yamlio import read_document
    from cfmkit.specs.yamlio.base_file import with_base

    if name == STDIN_PATH:
        return apply_options(with_base(read_document(standard_input(), "stdin", Path.cwd())), changes, of_many)
    return apply_options(with_base(read_document(content(name), name, Path(name).absolute().parent)), changes, of_many)


def apply_options(document: YamlDocument, changes: Iterable[str], of_many: bool = False) -> YamlDocument:
    """Return a document with options applied in their order.

    An option for another family is skipped where there are many specifications, and refused where there is only one.

    Raises UsageError if an option is malformed, for a family that does not exist, or for none that there is.
    """
    for change in changes:
        family, option = split_address(change)
        own_family = _family_of(document)
        if family in (None, own_family):
            document = document.set(option)
        elif own_family is not None and not of_many:
            raise UsageError(
                f"--set {visible(change)}: {visible(document.source)} is of the family {visible(own_family)!r}"
            )
    return document


def split_address(change: str) -> tuple[str | None, str]:
    """Return the family that an option such as ``cam:mechanism.roller_radius=10 mm`` is for, and the option itself.

    Raises UsageError if there is no such family.

    Examples
    --------
    >>> split_address("cam:analysis.points=51"), split_address("analysis.points=51")
    (('cam', 'analysis.points=51'), (None, 'analysis.points=51'))
    """
    path = change.partition("=")[0]
    family, colon, _ = path.partition(":")
    if not colon or not _FAMILY_PATTERN.fullmatch(family):
        return None, change
    from cfmkit import families

    if family not in families.names():
        close = difflib.get_close_matches(family, families.names(), n=1)
        hint = f"; did you mean {close[0]!r}?" if close else f": there are {', '.join(families.names())}"
        raise UsageError(f"--set {visible(change)}: there is no family {family!r}{hint}")
    return family, change[len(family) + 1 :]


_FAMILY_PATTERN = re.compile("[A-Za-z][A-Za-z0-9_-]*")
"""What may stand before the colon of an option for one family; a path with a colon has dots or quotes before it."""


def _family_of(document: YamlDocument) -> str | None:
    named = document.tree.get("family") if isinstance(document.tree, dict) else None
    return named if isinstance(named, str) else None


def standard_input() -> bytes:
    """Return what comes in, up to the size that no specification has.

    Raises UsageError if nothing can come in.
    """
    from cfmkit.specs.yamlio.tree_builder import MAX_FILE_BYTES

    if sys.stdin is None:
        raise UsageError("standard input is closed; name a file")
    return sys.stdin.buffer.read(MAX_FILE_BYTES + 1)


def content(name: str) -> bytes:
    """Return the bytes of a file.

    Raises UsageError in one sentence, if it is not there, a folder or not readable.
    """
    from cfmkit.specs.yamlio.tree_builder import MAX_FILE_BYTES

    if not name or "\0" in name:
        raise UsageError(f"{name!r} is not the name of a file")
    try:
        if Path(name).is_dir():
            raise UsageError(f"{visible(name)} is a folder; name the specification in it{_hint_of_file_inside(name)}")
        with open(name, "rb") as file:
            return file.read(MAX_FILE_BYTES + 1)
    except FileNotFoundError:
        raise UsageError(f"{visible(name)}: there is no such file{_hint_of_similar_names(name)}") from None
    except OSError as error:
        raise UsageError(f"{visible(name)} cannot be read: {reason_of(error)}") from None


def bind(document: YamlDocument) -> Spec:
    """Return the checked specification of the family that it names.

    Raises SpecError with every problem at once, those of the requirements' metrics included.
    """
    family = _family_record(document)
    try:
        spec = document.bind(family.spec_type)
    except SpecError as error:
        reported = {problem.path for problem in error.problems}
        raw = _readable_requirements(document.tree)
        more = [fault for fault in _requirement_faults(document, family, raw) if not _is_below(fault.path, reported)]
        faults = sorted([*error.problems, *more], key=lambda fault: (fault.line == 0, fault.line, fault.column))
        raise SpecError(faults) from None
    problems = [*_requirement_faults(document, family, enumerate(spec.requirements)), *_sweep_faults(document, spec)]
    problems += [*_sensitivity_faults(document, spec), *_design_faults(document, spec)]
    if problems:
        raise SpecError(problems)
    return spec


def _known_families(named: str | None) -> Sequence[str]:
    """Return the families among which one is looked for; other packages are not searched for one that is here."""
    from cfmkit import families

    if named in families.FAMILY_MODULES:
        return tuple(families.FAMILY_MODULES)
    return (named,) if named in families.clashing() else families.names()


def _family_record(document: YamlDocument) -> Family:
    """Return the family that a document names; one that cannot be used is a problem at that place."""
    from cfmkit import families

    try:
        return families.family(document.family(_known_families(_family_of(document))))
    except families.Unusable as problem:
        raise SpecError([document.problem(("family",), str(problem))]) from None


def _requirement_faults(
    document: YamlDocument, family: Family, requirements: Iterable[tuple[int, Requirement]]
) -> Iterator[Problem]:
    """Yield what is wrong with metric names, bounds and windows, each with its place in the file."""
    from cfmkit.metrics import known_metrics, requirement_problems, values_of_family

    metrics = known_metrics(None, values_of_family(family.outputs.values))
    for index, requirement in requirements:
        for problem in requirement_problems((requirement,), metrics, branches=family.outputs.branches):
            key = problem.path.rpartition(".")[2]
            yield place_problem(document, f"requirements.{index}.{key}", problem.message)


def _sweep_faults(document: YamlDocument, spec: Spec) -> Iterator[Problem]:
    """Yield what is wrong with paths and values of the block `sweep`, each with its place in the file."""
    if spec.sweep is None:
        return
    from cfmkit.studies.variations import collect_variations, faults

    drawn, joint = spec.sweep.combine in SAMPLE_KINDS, spec.sweep.combine == "zip"
    for request, message in faults(spec, collect_variations(spec.sweep.vary), drawn, joint):
        yield document.problem(("sweep", "vary", request.path), message)


def _sensitivity_faults(document: YamlDocument, spec: Spec) -> Iterator[Problem]:
    """Yield what is wrong with parameters and groups of the block `sensitivity`, each with its place in the file."""
    if spec.sensitivity is None:
        return
    from cfmkit.studies.parts.uncertain_values import faults

    for path, message in faults(spec, spec.sensitivity):
        yield document.problem(path, message)


def _design_faults(document: YamlDocument, spec: Spec) -> Iterator[Problem]:
    """Yield what is wrong with the tolerances of the block `design`, each with its place in the file."""
    from cfmkit.specs.further_metrics import OF_MANY_PARTS
    from cfmkit.specs.spec import DesignKeys

    design = getattr(spec, "design", None)  # a family need not have this block, nor another package's these keys
    lacking = "is a share of manufactured parts: state their tolerances in 'design.tolerances'"
    asked = [item for item in enumerate(spec.requirements) if item[1].metric in OF_MANY_PARTS]
    of_parts = {"tolerances", "free", "robust", "yield"}
    if isinstance(design, DesignKeys) and (asked or of_parts & design.model_fields_set):
        from cfmkit.studies.parts.parts import NO_TOLERANCE, errs_nowhere, faults, is_made

        if is_made(spec, design):
            lacking = f"is a share of manufactured parts: {NO_TOLERANCE}" if errs_nowhere(spec, design) else ""
        for path, message in faults(spec, design):
            yield document.problem(path, message)
    for index, requirement in asked if lacking else ():
        yield document.problem(("requirements", index, "metric"), f"{requirement.metric!r} {lacking}")


def place_problem(document: YamlDocument, path: str, message: str) -> Problem:
    """Return a problem with the place of a path in the file, or the option that set it."""
    fault = document.problem(path, message)
    return fault if fault.line or fault.source.startswith("--set") else Problem("--set", 0, 0, path, message)


def _readable_requirements(tree: Any) -> Iterator[tuple[int, Requirement]]:
    """Yield those requirements of an unchecked tree that can be read."""
    from cfmkit.specs.spec import readable_requirement

    entries = tree.get("requirements") if isinstance(tree, dict) else None
    for index, entry in enumerate(entries if isinstance(entries, tuple) else ()):
        if (requirement := readable_requirement(entry)) is not None:
            yield index, requirement


def _is_below(path: str, reported: set[str]) -> bool:
    return any(path == above or path.startswith(f"{above}.") for above in reported if above)


def rename_source(error: SpecError, old: str, new: str) -> SpecError:
    """Return the error with another name for the source of some problems, which stands for its path as well."""
    return SpecError(
        [
            replace(fault, source=new, path="" if old == f"--set {fault.path}" else fault.path)
            if fault.source == old
            else fault
            for fault in error.problems
        ]
    )


def _hint_of_similar_names(name: str) -> str:
    """Return a hint with the names in that folder that look alike."""
    folder, base = os.path.split(name)
    if folder and not os.path.isdir(folder):
        return f" (nor a folder {visible(folder)}){_shipped_hint(base)}"
    # without their endings: those are alike in any two names
    files = {os.path.splitext(file)[0]: file for file in _yaml_files(folder or ".")}
    close = difflib.get_close_matches(os.path.splitext(base)[0], files, n=1)
    return f"; did you mean {visible(os.path.join(folder, files[close[0]]))!r}?" if close else _shipped_hint(base)


def _shipped_hint(base: str) -> str:
    """Return how an example of that name is had: pages name it as it lies in the sources."""
    from cfmkit.runs.shipped_folders import shipped_folder

    try:
        shipped = next(shipped_folder("configs", "cam.yaml").rglob(glob.escape(base)), None) if base else None
    except UsageError:
        return ""
    return f"; `cfmkit examples {shipped.stem}` copies the one that is shipped" if shipped is not None else ""


def _hint_of_file_inside(folder: str) -> str:
    files = _yaml_files(folder)
    return f", e.g. {visible(os.path.join(folder, files[0]))}" if files else ""


def _yaml_files(folder: str) -> list[str]:
    try:
        return sorted(entry for entry in os.listdir(folder) if entry.lower().endswith((".yaml", ".yml")))
    except OSError:
        return []
