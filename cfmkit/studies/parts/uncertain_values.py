"""The block `sensitivity:` read against a specification: uncertain parameters, their distributions and correlations.

A parameter is uniform or normal, perhaps truncated. Several are joined by a Gaussian copula: correlation is that of the
normal scores, so that each parameter keeps its own distribution whatever it is correlated with.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.errors import Problem, QuantityError, SpecError
from cfmkit.numerics.unit_cube_samples import sample_unit_cube
from cfmkit.specs.study_spec import Tolerance
from cfmkit.specs.units import meant_as_percent, read_number, read_quantity
from cfmkit.studies.plan import Plan, Variable
from cfmkit.studies.variations import CannotVary, Leaf, leaf
from cfmkit.tables import border_values

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.specs.spec import Spec
    from cfmkit.specs.study_spec import Sensitivity


COVERED_DEVIATIONS = 3.0  # standard deviations on either side that stand for the range of a normal parameter


class Incompatible(ValueError):
    """Correlations that no set of variables can have together."""


@dataclass(frozen=True)
class ParameterSpread:
    """The distribution of one parameter."""

    kind: Literal["uniform", "normal"]  # its shape
    nominal: float  # where a perfect part would be
    # low, high: ends of a uniform distribution; truncation of a normal one, infinite for none
    low: float
    high: float
    deviation: float = 0.0  # standard deviation of the normal distribution before truncation

    @property
    def standard_deviation(self) -> float:
        """Of the distribution: that of the normal one before truncation, or of a range [SI]."""
        return self.deviation if self.kind == "normal" else (self.high - self.low) / 12.0**0.5

    @property
    def ends(self) -> tuple[float, float]:
        """The range that it covers: three standard deviations where it has no ends."""
        if self.kind == "uniform":
            return self.low, self.high
        reach = COVERED_DEVIATIONS * self.deviation
        return max(self.low, self.nominal - reach), min(self.high, self.nominal + reach)

    def tighten(self, factor: float) -> ParameterSpread:
        """Return the same distribution narrower about the nominal value."""
        low, high = (self.nominal + factor * (end - self.nominal) for end in (self.low, self.high))
        return replace(self, low=low, high=high, deviation=factor * self.deviation)

    def evaluate_quantiles(self, unit: FloatArray) -> FloatArray:
        """Return the values below which the shares `unit`, in (0, 1), of all parts lie."""
        if self.kind == "uniform":
            return self.low + unit * (self.high - self.low)
        from scipy.special import ndtr, ndtri

        below, above = (float(ndtr((end - self.nominal) / self.deviation)) for end in (self.low, self.high))
        inside = np.clip(below + unit * (above - below), _FLOAT_TINY, 1.0 - _FLOAT_EPSNEG)
        values = self.nominal + self.deviation * ndtri(inside)
        return np.asarray(np.clip(values, self.low, self.high))


_FLOAT_TINY = np.finfo(np.float64).tiny
_FLOAT_EPSNEG = float(np.finfo(np.float64).epsneg)


def values_at(spreads: Sequence[ParameterSpread], unit: FloatArray) -> FloatArray:
    """Return points in the unit cube, (n, d), as values of the parameters."""
    return np.stack([spread.evaluate_quantiles(unit[:, k]) for k, spread in enumerate(spreads)], axis=1)


def values_across(spreads: Sequence[ParameterSpread], unit: FloatArray) -> FloatArray:
    """Return points in the unit cube, (n, d), spread evenly over the ranges of the parameters."""
    ends = np.array([spread.ends for spread in spreads])
    return np.asarray(ends[:, 0] + unit * (ends[:, 1] - ends[:, 0]))


def correlation_matrix(count: int, groups: Iterable[tuple[Sequence[int], float]]) -> FloatArray:
    """Return the correlations of so many parameters, from groups of them and the correlation of each two of a group.

    Raises Incompatible if no variables can be correlated so.
    """
    matrix = np.eye(count)
    for members, correlation in groups:
        for first in members:
            for second in members:
                if first != second:
                    matrix[first, second] = correlation
    if np.linalg.eigvalsh(matrix).min() < -1e-9:
        raise Incompatible(
            "these correlations are impossible together: of three parameters not all pairs can be opposed"
        )
    return matrix


def draw(matrix: FloatArray, count: int, seed: int | list[int], kind: str | None = None) -> FloatArray:
    """Return points in the unit cube, (count, d), whose normal scores have these correlations.

    `kind`: one of `SAMPLE_KINDS`; None: at random.
    """
    from scipy.special import ndtr, ndtri

    values, vectors = np.linalg.eigh(matrix)
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    generator = np.random.default_rng(seed)
    if kind is None:
        scores = generator.standard_normal((count, len(matrix)))
    else:
        unit = sample_unit_cube(kind, len(matrix), count, generator)
        scores = ndtri(np.clip(unit, _FLOAT_TINY, 1.0 - _FLOAT_EPSNEG))
    # Without correlations the scores stay what was drawn, to the last bit.
    joined = scores if np.array_equal(matrix, np.eye(len(matrix))) else scores @ root.T
    return np.asarray(ndtr(joined))


Place = tuple[str | int, ...]

ALL_ITEMS = "*"  # in place of an index: all items of a list


@dataclass(frozen=True)
class Parameter:
    """One uncertain value."""

    path: str  # dotted
    dimension: str  # of `cfmkit.specs.units`
    spread: ParameterSpread  # how it is distributed [SI]
    several: bool = False  # whether a value may be of several dimensions: it knows which, as a length or an angle


def parameters_of(spec: Spec, block: Sensitivity) -> tuple[Parameter, ...]:
    """Return the parameters of a block, lists taken apart.

    Raises SpecError with every fault, at ``sensitivity.parameters`` and the path.
    """
    problems = list(faults(spec, block))
    if problems:
        raise SpecError([Problem("", 0, 0, ".".join(map(str, place)), message) for place, message in problems])
    return tuple(parameter for path, stated in block.parameters.items() for parameter in _expand(spec, path, stated))


def faults(spec: Spec, block: Sensitivity) -> Iterator[tuple[Place, str]]:
    """Yield (path of keys, what is wrong there) for every fault that the models cannot see."""
    seen: list[str] = []
    spoilt = False
    for path, stated in block.parameters.items():
        try:
            expanded = _expand(spec, path, stated)
        except CannotVary as problem:
            yield ("sensitivity", "parameters", path), str(problem)
            spoilt = True
            continue
        for parameter in expanded:
            if clash := next((path for path in seen if _overlap(parameter.path, path)), None):
                yield ("sensitivity", "parameters", path), f"{clash!r} is a parameter already; one of them is enough"
            seen.append(parameter.path)
    if not spoilt:
        yield from _group_faults(block, seen)


def _overlap(first: str, second: str) -> bool:
    return first == second or first.startswith(f"{second}.") or second.startswith(f"{first}.")


def _group_faults(block: Sensitivity, paths: Sequence[str]) -> Iterator[tuple[Place, str]]:
    for index, group in enumerate(block.correlated):
        for number, name in enumerate(group.parameters):
            if not _members(name, paths):
                stated_names = ", ".join(block.parameters)
                place = ("sensitivity", "correlated", index, "parameters", number)
                yield place, f"{name!r} is not among the parameters: {stated_names}"
        if len({k for name in group.parameters for k in _members(name, paths)}) == 1:
            yield ("sensitivity", "correlated", index), "a correlation needs at least two parameters"
    try:
        correlations(block, paths)
    except Incompatible as problem:
        yield ("sensitivity", "correlated"), str(problem)


def _members(name: str, paths: Sequence[str]) -> tuple[int, ...]:
    """Return the numbers of the parameters that a name stands for."""
    pattern = re.escape(name).replace(re.escape(ALL_ITEMS), "[0-9]+")
    return tuple(k for k, path in enumerate(paths) if re.fullmatch(pattern, path))


def groups(block: Sensitivity, paths: Sequence[str]) -> tuple[tuple[tuple[int, ...], float], ...]:
    """Return (numbers of parameters, correlation) of every group."""
    return tuple(
        (tuple(dict.fromkeys(k for name in group.parameters for k in _members(name, paths))), group.correlation)
        for group in block.correlated
    )


def correlations(block: Sensitivity, paths: Sequence[str]) -> FloatArray:
    """Return the matrix of correlations.

    Raises Incompatible if the correlations are impossible together.
    """
    return correlation_matrix(len(paths), groups(block, paths))


def together(block: Sensitivity, paths: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """Return the parameters in groups that are tightened together: correlated ones, and those of one list."""
    parts = {k: {k} for k in range(len(paths))}
    joint = [members for members, _ in groups(block, paths)]
    joint += [_members(name, paths) for name in block.parameters if ALL_ITEMS in name.split(".")]
    for members in joint:
        union = set().union(*(parts[k] for k in members))
        for k in union:
            parts[k] = union
    return tuple(dict.fromkeys(tuple(sorted(part)) for part in parts.values()))


def _expand(spec: Spec, path: str, stated: tuple[str, str] | Tolerance) -> list[Parameter]:
    return [_read_parameter(spec, item, stated) for item in _list_paths(spec, path)]


def _list_paths(spec: Spec, path: str) -> list[str]:
    """Return the paths of the parameters that a path stands for: with a star those of all items of a list."""
    before, star, after = path.partition(f".{ALL_ITEMS}")
    if not star:
        return [path]
    try:
        values = spec.get_value(before)
    except KeyError:
        values = None
    if not isinstance(values, tuple):
        raise CannotVary(f"{before!r} is not a list in this specification; leave the star out")
    return [item for index in range(len(values)) for item in _list_paths(spec, f"{before}.{index}{after}")]


def _read_parameter(spec: Spec, path: str, stated: tuple[str, str] | Tolerance) -> Parameter:
    place = leaf(type(spec), path)
    if place.kind not in ("quantity", "number"):
        raise CannotVary(f"{path!r} does not vary continuously; `cfmkit sweep` goes through its values")
    nominal, dimension = _read_nominal(spec, place)
    spread = _tolerance(place, stated, nominal) if isinstance(stated, Tolerance) else _range(place, stated, nominal)
    return Parameter(path, dimension, spread, place.has_several_dimensions)


def _read_nominal(spec: Spec, place: Leaf) -> tuple[float, str]:
    try:
        value = spec.get_value(place.path)
    except KeyError:
        value = None
    if isinstance(value, tuple):
        raise CannotVary(f"{place.path!r} is a list here; write {place.path}.{ALL_ITEMS} for all its items")
    if value is None:
        raise CannotVary(f"{place.path!r} has no value in this specification; give it one")
    if place.kind == "number":
        return float(value), "ratio"
    return float(value), getattr(value, "dimension", place.quantity.dimensions[0] if place.quantity else "ratio")


def _range(place: Leaf, stated: tuple[str, str], nominal: float) -> ParameterSpread:
    low, high = (_read_value(place, text) for text in stated)
    if not low < high:
        raise CannotVary(f"[{stated[0]}, {stated[1]}] is not a range: the first must be smaller than the second")
    return ParameterSpread("uniform", nominal, low, high)


def _tolerance(place: Leaf, stated: Tolerance, nominal: float) -> ParameterSpread:
    if stated.uniform is not None:
        width = _width(place, "uniform", stated.uniform, nominal)
        return ParameterSpread("uniform", nominal, nominal - width, nominal + width)
    deviation = _width(place, "normal", stated.normal or "", nominal)
    reach = math.inf if stated.truncate is None else _width(place, "truncate", stated.truncate, nominal)
    return ParameterSpread("normal", nominal, nominal - reach, nominal + reach, deviation)


def _width(place: Leaf, key: str, text: str, nominal: float) -> float:
    """Return the size of a tolerance [SI]; a percentage is of the nominal value."""
    if text.endswith("%"):
        share = _read_percent(key, text)
        if share > 1:
            raise CannotVary(f"{key}: {text} is more than the value itself: at most 100 %, or give it in its unit")
        width = share * abs(nominal)
        if not nominal:
            raise CannotVary(f"{key}: {text} of zero is zero; give it in the unit of the value")
    else:
        width = _read_value(place, text, key)
        share = place.quantity is not None and place.quantity.dimensions == ("ratio",) and abs(nominal) <= 1
        if share and (meant := meant_as_percent(text)):
            raise CannotVary(f"{key}: {text} is more than the value itself; did you mean {meant}?")
    if not width > 0:
        raise CannotVary(f"{key}: {text} is not allowed: must be > 0")
    return width


def _read_percent(key: str, text: str) -> float:
    try:
        return read_quantity(text, "ratio")
    except QuantityError as problem:
        raise CannotVary(f"{key}: {problem}") from None


def _read_value(place: Leaf, text: str, key: str = "") -> float:
    """Return the SI value of text in the unit of a value."""
    try:
        stated: Any = read_number(text) if place.kind == "number" else text
        return float(place.read(stated)[0])
    except (CannotVary, QuantityError) as problem:
        raise CannotVary(f"{key}: {problem}" if key else str(problem)) from None


def with_options(block: Sensitivity | None, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a block says once options have replaced some of it.

    Samples, their number and how they are drawn, are those of the block's own method: another method chooses its own.
    """
    reported = block.model_dump(exclude_unset=True) if block else {}
    if block is not None and changes.get("method", block.method) != block.method:
        reported = {key: value for key, value in reported.items() if key not in ("samples", "sampling")}
    return reported | {key: value for key, value in changes.items() if value is not None}


def plan_of(parameters: Sequence[Parameter], points: FloatArray) -> Plan:
    """Return points, (n, d), as a plan of the engine."""
    columns = map(np.ascontiguousarray, points.T)
    varied = (
        Variable(
            parameter.path, parameter.dimension, values, border_values(values, parameter.dimension), parameter.several
        )
        for parameter, values in zip(parameters, columns, strict=True)
    )
    return Plan(tuple(varied), len(points), joint=True)
