"""A specification whose numbers are moved by sliders: the sliders, answers for the page on a changed one, saving.

`Explorer` holds the file as it was written and answers changes of it as data for a page. Changes are those of
``--set``: a page can say no more than a command line.
"""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit import api
from cfmkit.documents.document import command_line
from cfmkit.documents.html import escaped_json, part, template
from cfmkit.documents.run_document import document_of, shown_window
from cfmkit.documents.run_outcome import report_on
from cfmkit.errors import CfmError, OutputError, SpecError, UsageError, lines_of, visible
from cfmkit.results import Status
from cfmkit.runs.specfile import apply_options, bind, read_spec
from cfmkit.specs.block import STUDY_BLOCKS
from cfmkit.specs.units.strict_decimal_number import NUMBER_PATTERN

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from cfmkit.curves import Curve
    from cfmkit.results import Result
    from cfmkit.runs.notebook_result import AnalysisView
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.yamlio import YamlDocument


LEFT_OUT = ("cfmkit", "family", "name", "description", "design", *STUDY_BLOCKS)
"""Blocks without sliders: what is analysed does not depend on them."""
MOST_POINTS = 600  # points of a branch that the page draws: more than there are pixels across its diagram
SLIDER_SPAN = 0.5
"""Share of a value by which its slider goes down and up: far enough to see a trend, near enough to stay a mechanism."""
RELATIVE_STEP = 0.01
"""Share of a value by which it is changed to find its influence: above the noise of solvers, and a small change."""
PAIR_LABELS = {name: ("x", "y") for name in ("at", "mirror")} | {
    name: ("from", "to") for name in ("window", "over", "travel")
}
"""What the two numbers of a list are called."""
OWN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._ -]{0,80}\.ya?ml")
"""Names of files that the page may save: no folder, nothing hidden."""


@dataclass(frozen=True)
class Slider:
    """A number of the specification that can be moved."""

    path: str  # dotted, as ``--set`` takes it
    # value, low, high, step: in its unit
    value: float
    low: float
    high: float
    step: float
    unit: str  # as the file has it; empty for a plain number
    about: str  # what it is
    whole: bool  # whether it is a whole number

    @property
    def label(self) -> str:
        """Text beside it: the key, or what a number of a list is."""
        *_, group, key = ("", *self.path.split("."))
        if not key.isdecimal():
            return key.replace("_", " ")
        pair = PAIR_LABELS.get(group, ())
        return pair[int(key)] if int(key) < len(pair) else f"number {int(key) + 1}"


@dataclass
class Explorer:
    """A specification to be explored."""

    source: str  # the file
    document: YamlDocument  # what it says
    folder: Path = field(init=False)  # that of the file; what the page saves is written there, and nowhere else

    def __post_init__(self) -> None:
        """Note the folder beside which nothing is read or written."""
        self.folder = Path(self.source).absolute().parent

    @classmethod
    def from_file(cls, source: str, changes: tuple[str, ...] = ()) -> Explorer:
        """Return the explorer of a file.

        Raises UsageError if it cannot be read; SpecError with every problem in it.
        """
        document = read_spec(source, changes)
        bind(document)
        return cls(source, document)

    def spec(self, changes: Sequence[str] = ()) -> Spec:
        """Return the specification with changes."""
        return bind(apply_options(self.document, changes))

    @cached_property
    def sliders(self) -> tuple[Slider, ...]:
        """A slider for every number of the specification, those that it leaves to their defaults included."""
        from cfmkit.specs.keys_and_schema import keys
        from cfmkit.specs.yamlio import read_document

        spec = self.spec()
        keys_by_path = {key.path: key for key in keys(type(spec))}
        tree = read_document(api.dumps(spec, complete=True), "spec").tree
        sliders = []
        for path, value in _dotted_leaves({key: tree[key] for key in tree if key not in LEFT_OUT}):
            key = keys_by_path.get(re.sub(r"\.\d+", "[]", path)) or keys_by_path.get(re.sub(r"\.\d+$", "", path))
            about, whole = (key.description, key.kind == "whole number") if key else ("", False)
            if (slider := _slider_of_value(path, value, about, whole)) is not None:
                sliders.append(slider)
        return tuple(sliders)

    def answer(self, changes: Sequence[str]) -> dict[str, Any]:
        """Return what a page shows of the changed specification: curve, metrics, requirements, or what is wrong."""
        start = time.perf_counter()
        try:
            page = _page_data(api.analyze(self.spec(changes)))
        except CfmError as error:
            page = {"problem": [line.removeprefix("error    ") for line in lines_of(error)]}
            if isinstance(error, SpecError):
                page["places"] = [
                    {"path": problem.path or problem.source.removeprefix("--set "), "message": problem.message}
                    for problem in error.problems
                ]
        return page | {"seconds": time.perf_counter() - start}

    def influence(self, path: str) -> dict[str, Any]:
        """Return the share of its bounds by which 1 % more of a value moves the requirements, or the mean effort.

        Zero where the value cannot be changed alone, and of values that are no part of the mechanism.
        """
        slider = next((item for item in self.sliders if item.path == path), None)
        if slider is None:
            return {"influence": 0.0}
        size = abs(slider.value) or slider.high - slider.low
        step = 1.0 if slider.whole else RELATIVE_STEP * size
        written = f"{path}={slider.value + step:.12g} {slider.unit}".rstrip()
        try:
            moved = _requirement_sizes(api.analyze(self.spec([written])))
            nominal = self._nominal_sizes
        except CfmError:
            return {"influence": 0.0}
        shares = [
            abs(moved[name][0] - value) / size for name, (value, size) in nominal.items() if name in moved and size
        ]
        return {"influence": max(shares, default=0.0) * RELATIVE_STEP * size / step}

    @cached_property
    def _nominal_sizes(self) -> dict[str, tuple[float, float]]:
        return _requirement_sizes(api.analyze(self.spec()))

    def command(self, changes: Sequence[str]) -> str:
        """Return the command that analyses the specification with changes."""
        settings = [word for change in changes for word in ("--set", change)]
        return command_line("cfmkit", "analyze", self.source, *settings)

    def drawing(self, changes: Sequence[str]) -> dict[str, Any]:
        """Return the mechanism in the middle of its travel as SVG; empty where its family draws none."""
        from cfmkit.families import family
        from cfmkit.plots.figures import moving_of
        from cfmkit.plots.mechanism_in_motion import still

        try:
            result = api.analyze(self.spec(changes))
            moving = moving_of(family(result.spec.family), result)
        except CfmError:
            moving = None
        drawn = (
            "" if moving is None else still(moving, len(moving.motion) // 2, "the mechanism to scale, at mid-travel")
        )
        return {"svg": drawn}

    def yaml(self, changes: Sequence[str]) -> str:
        """Return the specification with changes as YAML."""
        return api.dumps(self.spec(changes))

    def save(self, name: str, changes: Sequence[str]) -> dict[str, Any]:
        """Write the specification with changes beside its file; nothing is replaced.

        Raises UsageError if it is not the plain name of a YAML file; OutputError if there is such a file, or it cannot
        be written.
        """
        from cfmkit.store.safe_disk_changes import reporting, write_new

        if not OWN_NAME.fullmatch(name):
            raise UsageError(f"{visible(name)!r}: name a file such as mine.yaml, without a folder")
        target = self.folder / name
        if target.exists() or target.is_symlink():
            raise OutputError(f"cannot write {visible(name)}: the file exists")
        with reporting(name):
            write_new(target, self.yaml(changes).encode())
        return {"saved": name}

    def page(self, token: str, nonce: str = "") -> bytes:
        """Return the page of the explorer, with the token that its requests carry and the nonce of its script."""
        spec = self.spec()
        groups: dict[str, list[Slider]] = {}
        for slider in self.sliders:
            groups.setdefault(slider.path.rpartition(".")[0], []).append(slider)
        data = {"token": token, "source": self.source, "first": self.answer(())}
        text: str = template("explorer.html.j2", "cfmkit.runs").render(
            title=spec.name,
            family=spec.family,
            groups={name: (_heading_of_group(name, spec), sliders) for name, sliders in groups.items()},
            data=escaped_json(data),
            nonce=nonce,
            style=part("report.css") + part("explorer.css", "cfmkit.runs"),
            script=part("explorer.js", "cfmkit.runs"),
            suggestion=suggested_name(Path(self.source).stem),
        )
        return text.encode()


def suggested_name(stem: str) -> str:
    """Return the name under which the page offers to save: that of the file, as far as `OWN_NAME` has such letters.

    Examples
    --------
    >>> suggested_name("cam 2"), suggested_name("träger<b>"), suggested_name(".-")
    ('cam 2-explored.yaml', 'tr-ger-b-explored.yaml', 'explored.yaml')
    """
    plain = re.sub(r"[^A-Za-z0-9._ -]+", "-", stem).strip("._ -")[:60].rstrip("._ -")
    return f"{plain}-explored.yaml" if plain else "explored.yaml"


def _heading_of_group(group: str, spec: Spec) -> str:
    """Return what stands above a group of sliders: its path; of a requirement, also which metric it is about."""
    match = re.match(r"requirements\.(\d+)", group)
    return f"{group}: {spec.requirements[int(match[1])].metric}" if match else group


def _dotted_leaves(tree: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(tree, dict):
        for key, value in tree.items():
            if "." not in key:
                yield from _dotted_leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(tree, tuple | list):
        for number, value in enumerate(tree):
            yield from _dotted_leaves(value, f"{path}.{number}")
    else:
        yield path, tree


def _slider_of_value(path: str, value: Any, about: str, whole: bool) -> Slider | None:
    """Return the slider of a leaf; None if it is not a number."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    unit = ""
    number = value
    if isinstance(value, str):
        match = NUMBER_PATTERN.match(value)
        if match is None or not re.fullmatch(r" ?[^\s\d].*", value[match.end() :]):
            return None
        number, unit = float(match[0]), value[match.end() :].strip()
    number = float(number)
    if not np.isfinite(number):
        return None
    low, high = sorted((number * (1 - SLIDER_SPAN), number * (1 + SLIDER_SPAN))) if number else (0.0, 1.0)
    if whole:
        low, high = float(np.floor(low)), float(np.ceil(high)) + (not number)
    step = 1.0 if whole else 10.0 ** np.round(np.log10((high - low) / 200))
    return Slider(path, number, float(f"{low:.6g}"), float(f"{high:.6g}"), float(f"{step:.1e}"), unit, about, whole)


def _page_data(result: Result) -> dict[str, Any]:
    """Return a result as data for the page: its document, which the command line prints, and its curve."""
    from cfmkit.plots.bands_from_requirements import bands_of
    from cfmkit.specs.units import border_unit, to_border

    def border(value: float | None, dimension: str) -> float | None:
        return None if value is None else float(to_border(value, dimension))

    report = report_on(result)
    document = document_of(report)
    page: dict[str, Any] = {
        "tone": document.tone,
        "verdict": document.verdict,
        "summary": document.summary,
        "message": "" if result.status is Status.COMPLETE else report.message,
        "requirements": [{"sentence": outcome.sentence, "ok": outcome.ok} for outcome in report.requirements],
        "rows": [
            {"label": row.label, "value": row.value, "bound": row.bound, "ok": row.ok, "about": row.about}
            for row in document.headline
        ],
        "notes": [[note.word, note.text] for note in document.notes if note.text != report.message],
        "warnings": [
            {"name": warning.name, "short": warning.short, "text": warning.text} for warning in document.warnings
        ],
    }
    if result.curves:
        curve = result.curves[0]
        window, motion = shown_window(report), curve.motion_dimension
        page["curve"] = {
            "x": f"{curve.motion_name} [{border_unit(motion)}]",
            "y": f"{curve.kind} [{border_unit(curve.kind)}]",
            "branches": dict(_branch_points(curve)),
            "window": None if window is None else [border(end, motion) for end in (window.lo, window.hi)],
            "bands": [
                {name: border(end, curve.kind) for name, end in (("low", band.low), ("high", band.high))}
                | {"from": border(band.start, motion), "to": border(band.stop, motion)}
                | {"text": band.text, "ok": band.met}
                for band in bands_of(result)
            ],
        }
    return page


def _requirement_sizes(result: AnalysisView) -> dict[str, tuple[float, float]]:
    """Return the value of each required metric with the size of its bound, and the mean effort with its own, in SI."""
    judged = {
        outcome.metric: (outcome.value, max(abs(end) for end in (outcome.min, outcome.max) if end is not None))
        for outcome in result.requirements
        if outcome.value is not None
    }
    if result.curves:
        name = f"{result.curve.kind}_mean"
        mean = api.evaluate(result, [name])[name].value
        judged |= {} if mean is None else {"mean": (mean, abs(mean))}
    return judged


def _branch_points(curve: Curve) -> Iterator[tuple[str, list[list[float | None]]]]:
    from cfmkit.specs.units import to_border

    for name in dict.fromkeys(curve.branches):
        on = np.flatnonzero(curve.branch == name)
        on = on[np.unique(np.linspace(0, len(on) - 1, min(len(on), MOST_POINTS)).round().astype(int))]
        motion = to_border(curve.motion[on], curve.motion_dimension)
        effort = to_border(curve.effort[on], curve.kind)
        yield name, [[_five_digits(value) for value in side] for side in (motion, effort)]


def _five_digits(value: float) -> float | None:
    return float(f"{value:.5g}") if np.isfinite(value) else None
