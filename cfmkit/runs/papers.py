"""Numbers that the papers print (`printed_numbers.yaml`), computed again and compared; the grammar of their questions.

A row is for each number, or each few that belong together: where it stands, what it is, the verdict, and how to compute
the same. `check` computes it again and says whether the verdict holds.

A row asks in a closed grammar, in SI: names of metrics (``force_mean[load]``), dotted paths of the specification
(``mechanism.springs.stiffness[0]``), columns of the first curve at a place (``force("13.6 mm")``, a branch second),
quantities in quotes, numbers, ``+ - * / **``, a few functions, and ``changed("path=value", ...)``: the rest of the
question with one value changed; ``varied("path")``: what the sweep of the specification gives to a value.
"""

from __future__ import annotations

import ast
import math
import operator
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from cfmkit.errors import CfmError, UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from cfmkit.curves import Curve
    from cfmkit.runs.notebook_result import AnalysisView
    from cfmkit.specs.spec import Spec

VERDICT_MEANINGS: Mapping[str, str] = {
    "agrees": "computed here; equal to the last printed digit, or within a tolerance for which the row gives a reason",
    "arithmetic": "follows from other numbers that the paper prints: equal to the last digit, and no result of a model",
    "given": "an input: the example states it as printed, or the command of the row sets it",
    "misprint": "wrong as printed; the row says why, and gives the right value",
    "disagrees": "computed here with a different result; the row says what is known about the reason",
    "measured there": "an experiment of the authors; if the model has the same quantity, its value is shown beside it",
    "not modelled": "cfmkit has no such model or part",
}
"""Every verdict with its meaning, in the order in which they are counted."""


@dataclass(frozen=True)
class PrintedRow:
    """Values that a paper prints at one place."""

    paper: str  # first author and year, as `cfmkit show references` has it
    family: str  # of the mechanism
    # place, what: section, table, figure or equation; the quantity
    place: str
    what: str
    printed: tuple[str, ...]  # as printed, with units; ``>``, ``<`` and ``~`` (about) may lead
    verdict: str  # one of `VERDICT_MEANINGS`
    why: str = ""  # the reason, of every verdict that needs one
    spec: str = ""  # name of the example; empty where nothing is computed from one
    changes: tuple[str, ...] = ()  # as ``--set`` takes them
    # `design` asks the specification that it finds, and the analysis of that; `sweep` what is varied
    verb: Literal["analyze", "design", "sweep"] = "analyze"
    ask: tuple[str, ...] = ()  # as many as `printed`, or one that has as many values; empty where nothing is computed
    expected: tuple[str, ...] = ()  # what is computed if that is not what is printed
    tolerance: str = ""  # how far off an agreeing number may be; empty: half a unit of its last digit
    heavy: bool = False  # whether it takes long

    @property
    def command(self) -> str:
        """The command that repeats it; empty where there is none."""
        import shlex

        if not self.spec:
            return ""
        changes = [word for change in self.changes for word in ("--set", shlex.quote(change))]
        return " ".join(["cfmkit", self.verb, f"configs/{self.spec}.yaml", *changes])


@dataclass(frozen=True)
class ComputedRow:
    """A row with what was computed."""

    row: PrintedRow  # what the paper prints
    computed: tuple[str, ...] = ()  # in the units of the paper, with two digits more; empty where nothing was computed
    trouble: str = ""  # why the verdict does not hold; empty: it does
    skipped: bool = False  # whether the row was left out because it takes long


def rows() -> tuple[PrintedRow, ...]:
    """Return every row, paper by paper as they are in the file."""
    from cfmkit.specs.yamlio.tree_builder import read_trusted

    text = Path(__file__).with_name("printed_numbers.yaml").read_text(encoding="utf-8")
    papers: Mapping[str, Mapping[str, Any]] = read_trusted(text)
    return tuple(
        _row_from_entry(paper, item["family"], entry) for paper, item in papers.items() for entry in item["rows"]
    )


def _row_from_entry(paper: str, family: str, entry: Mapping[str, Any]) -> PrintedRow:
    keys: dict[str, Any] = dict(entry)
    for name in ("printed", "ask", "expected"):
        keys[name] = _as_texts(keys.get(name, ()))
    return PrintedRow(paper=paper, family=family, changes=_as_texts(keys.pop("set", ())), **keys)


def _as_texts(value: Any) -> tuple[str, ...]:
    return tuple(map(str, value)) if isinstance(value, list | tuple) else (str(value),)


def choose_rows(name: str | None) -> tuple[PrintedRow, ...]:
    """Return the rows of one paper, or of a family's papers, or all.

    Raises UsageError if there is no such paper or family.
    """
    from cfmkit.specs.yamlio import did_you_mean

    every = rows()
    if name is None:
        return every
    if wanted := tuple(row for row in every if name.lower() in (row.paper, row.family)):
        return wanted
    names = dict.fromkeys([*(row.paper for row in every), *(row.family for row in every)])
    hint = did_you_mean(name, list(names)) or f"there are {', '.join(names)}"
    raise UsageError(f"there is no paper {visible(name)!r}; {hint}")


def check(some: Sequence[PrintedRow], everything: bool = False) -> Iterator[ComputedRow]:
    """Compute rows again, one after the other; those that take long only with `everything`."""
    for row in some:
        if not row.ask:
            yield ComputedRow(row)
        elif row.heavy and not everything:
            yield ComputedRow(row, skipped=True)
        else:
            yield _check_row(row)


def _check_row(row: PrintedRow) -> ComputedRow:
    try:
        values = _compute_values(row)
    except (CfmError, ValueError, KeyError) as error:
        return ComputedRow(row, trouble=f"cannot be computed: {error.args[0] if error.args else error}")
    shown = tuple(_report_value(value, text) for value, text in zip(values, row.expected or row.printed, strict=True))
    return ComputedRow(row, shown, "; ".join(_faults_of_verdict(row, values)))


def _compute_values(row: PrintedRow) -> tuple[float, ...]:
    scope = _Scope(row.spec, row.changes, row.verb)
    answers = [_evaluate(text, scope) for text in row.ask]
    values = tuple(
        float(number) for value in answers for number in (value if isinstance(value, tuple | list) else (value,))
    )
    if len(values) != len(row.printed):
        raise ValueError(f"{len(values)} values for {len(row.printed)} numbers")
    return values


def _faults_of_verdict(row: PrintedRow, values: Sequence[float]) -> Iterator[str]:
    """Yield what speaks against the verdict of a row."""
    if row.verdict == "agrees" and not all(map(_asks_model, row.ask)):
        yield "nothing is computed by a model: its verdict is 'arithmetic'"
    if row.verdict == "arithmetic" and any(map(_asks_model, row.ask)):
        yield "a model computes it: its verdict is not 'arithmetic'"
    for value, printed in zip(values, row.printed, strict=True):
        if row.verdict in ("agrees", "arithmetic", "given") and not _matches(value, printed, row.tolerance):
            yield f"{_report_value(value, printed)} is not {printed}"
        if row.verdict in ("misprint", "disagrees") and _is_quantity(printed) and _matches(value, printed):
            yield f"{_report_value(value, printed)} is what is printed"
    for value, expected in zip(values, row.expected, strict=bool(row.expected)):
        if not _matches(value, expected):
            yield f"{_report_value(value, expected)} is not {expected}"


@dataclass(frozen=True)
class Number:
    """A printed number: what leads it, its digits, its unit and the size of that in SI."""

    sign: str
    digits: Decimal
    unit: str
    size: float

    @property
    def value(self) -> float:
        """In SI."""
        return float(self.digits) * self.size

    @property
    def last(self) -> float:
        """One unit of the last digit, in SI."""
        return 10.0 ** int(self.digits.as_tuple().exponent) * self.size


def number(text: str) -> Number:
    """Return a printed number.

    Raises QuantityError if it is none.

    Examples
    --------
    >>> found = number("> 53 %")
    >>> found.sign, found.value, found.last
    ('>', 0.53, 0.01)
    """
    from cfmkit.errors import QuantityError
    from cfmkit.specs.units.strict_decimal_number import read_number
    from cfmkit.specs.units.table import unit_size

    sign, rest = (text[0], text[1:].strip()) if text[:1] in "<>~" else ("", text)
    digits, _, unit = rest.partition(" ")
    if not digits:
        raise QuantityError(f"{visible(text)!r} is not a number")
    read_number(digits)
    return Number(sign, Decimal(digits), unit, float(unit_size(unit).factor) if unit else 1.0)


def _is_quantity(text: str) -> bool:
    try:
        number(text)
    except CfmError:
        return False
    return True


def _matches(value: float, text: str, tolerance: str = "") -> bool:
    """Return whether a value is what a text says, to its last digit or within a tolerance."""
    wanted = number(text)
    if wanted.sign in ("<", ">"):
        return value < wanted.value if wanted.sign == "<" else value > wanted.value
    room = number(tolerance).value if tolerance else 0.5 * wanted.last
    return abs(value - wanted.value) <= room * (1 + 1e-9) + 1e-12 * abs(wanted.value)


def _report_value(value: float, text: str) -> str:
    """Return a value in the unit of a printed text, with two digits more."""
    if not _is_quantity(text):
        return f"{value:.6g}"
    like = number(text)
    places = max(0, 2 - int(like.digits.as_tuple().exponent))
    scaled = value / like.size
    small = scaled != 0 and abs(scaled) < 10.0 ** (2 - places)
    digits = f"{scaled:.4g}" if small else f"{scaled:.{min(places, 12)}f}"
    return f"{digits} {like.unit}".rstrip()


# --- what a row asks ---------------------------------------------------------------------------------------------


class _Scope(NamedTuple):
    """Scope of the names of a question: an example with changes, as it is analysed, designed or swept."""

    spec: str
    changes: tuple[str, ...] = ()
    verb: str = "analyze"


@cache
def _make_spec(scope: _Scope) -> Spec:
    from cfmkit import api
    from cfmkit.runs.shipped_files import example

    if not scope.spec:
        raise ValueError("no example is named")
    spec = api.load(example(scope.spec).path, scope.changes)
    if scope.verb != "design":
        return spec
    designed = api.design(spec).spec
    if designed is None:
        raise ValueError("the design has no solution")
    return designed


@cache
def _analyze_example(scope: _Scope) -> AnalysisView:
    from cfmkit import api

    return api.analyze(_make_spec(scope))


_BINARY_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_MATH_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    name: getattr(math, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt")
} | {"abs": abs, "min": min, "max": max, "count": len}
_SPEC_BLOCKS = ("mechanism", "analysis", "design")


def _asks_model(text: str) -> bool:
    """Return True if a question has a name in it, of a metric, a column or a key: not only printed numbers.

    Examples
    --------
    >>> _asks_model('("11.26 N" - "10.75 N") / "11.26 N"'), _asks_model('0.95 * force("13.6 mm")')
    (False, True)
    """
    names = {node.id for node in ast.walk(ast.parse(text.strip(), mode="eval")) if isinstance(node, ast.Name)}
    return not names <= _MATH_FUNCTIONS.keys()


def _evaluate(text: str, scope: _Scope) -> Any:
    """Return what a question is answered with, in SI."""
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except SyntaxError:
        raise ValueError(f"{text!r} is no question") from None
    return _value_of_node(tree, scope)


def _value_of_node(node: ast.expr, scope: _Scope) -> Any:
    match node:
        case ast.Constant(value=str(text)):
            return number(text).value
        case ast.Constant(value=int() | float() as value):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value_of_node(inner, scope)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY_OPERATORS:
            return _BINARY_OPERATORS[type(op)](_value_of_node(left, scope), _value_of_node(right, scope))
        case ast.Call(func=ast.Name(id="changed"), args=[ast.Constant(value=str(change)), inner]):
            return _value_of_node(inner, scope._replace(changes=(*scope.changes, change)))
        case ast.Call(func=ast.Name(id="varied"), args=[ast.Constant(value=str(path))]):
            return _varied_values(_make_spec(scope), path)
        case ast.Call(func=ast.Name(id=name), args=args) if name in _MATH_FUNCTIONS:
            return _MATH_FUNCTIONS[name](*(_value_of_node(argument, scope) for argument in args))
        case ast.Call(func=ast.Name(id=column), args=[place, *branch]):
            return _value_on_curve(
                _analyze_example(scope).curves[0], column, _value_of_node(place, scope), *map(ast.literal_eval, branch)
            )
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return _value_named(ast.unparse(node), scope)
    raise ValueError(f"{ast.unparse(node)!r} is no question")


def _value_named(name: str, scope: _Scope) -> Any:
    """Return a value of the specification, or a metric."""
    if name.startswith(tuple(f"{block}." for block in _SPEC_BLOCKS)):
        return _make_spec(scope).get_value(name.replace("[", ".").replace("]", ""))
    metric = _analyze_example(scope).metrics.get(name)
    if metric is None or metric.value is None:
        raise ValueError(f"{name} has no value")
    return metric.value


def _varied_values(spec: Spec, path: str) -> tuple[float, ...]:
    """Return the values that a sweep gives to something."""
    from cfmkit.studies.plan import step_axis
    from cfmkit.studies.variations import axes, collect_variations

    for axis in axes(spec, collect_variations(spec.sweep.vary)) if spec.sweep else ():
        if axis.leaf.path == path:
            return tuple(map(float, step_axis(axis).values))
    raise ValueError(f"no sweep varies {path}")


def _value_on_curve(curve: Curve, column: str, place: float, branch: str | None = None) -> float:
    """Return a column at a place, linear between the points."""
    import numpy as np

    on = curve if branch is None else curve.select_branch(branch)
    values = on.effort if column in ("force", "torque") else on.extra[column].values if column in on.extra else None
    if values is None:
        raise ValueError(f"the curve has no column {column!r}")
    if not on.motion.min() <= place <= on.motion.max():
        raise ValueError("the place is not on the curve")
    return float(np.interp(place, on.motion, np.asarray(values, dtype=float)))
