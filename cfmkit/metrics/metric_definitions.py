"""The table of constant-force metrics: each by name, with dimension, definition, source and function.

A metric of a force curve is called ``force_mean``; of a torque curve, where it
is a torque over an angle, ``torque_mean``. Names without ``force_`` are the same
for both. On a torque curve ``force_ripple`` is accepted for ``torque_ripple``: whoever compares
mechanisms need not know what drives them.

Sources
-------
[SS] Sanchez-Salinas et al., Mech. Mach. Theory 173 (2022) 104819.
[D] Ding, Li, Li (2022), compliant mechanism with variable constant force.
[B] Bilancia, Geraci, Berselli, SMASIS2019-5519.
[L] Lan, Wang, Chen (2010), compliant constant-force mechanism of slender beams.
[LH] Li, Hao, Chin. J. Mech. Eng. 32 (2019), doi:10.1186/s10033-019-0369-z.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics import ranges, window_metrics
from cfmkit.metrics.spread import STATIC_BALANCE
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from cfmkit.curves import Kind


Worst = Literal["largest", "smallest", "farthest-from-target"]
Scope = Literal["branch", "cycle", "loop", "value"]

_PLACEHOLDERS: Mapping[Kind, Mapping[str, str]] = {
    "force": {"effort": "force", "motion": "length", "work": "energy"},
    "torque": {"effort": "torque", "motion": "angle", "work": "energy"},
}
_WORDS = {"force": "displacement", "torque": "angle"}


@dataclass(frozen=True)
class Definition:
    """Definition of a metric."""

    name: str  # as requirements and tables call it
    dimension: str  # a name of `cfmkit.specs.units`, or "effort", "motion", "work": what that is depends on the curve
    definition: str  # one sentence with the source; ``{effort}`` and ``{motion}`` stand for the curve's words
    # takes a `Branch` (or the `Cycle`, see `scope`), returns SI or raises `Undefined`; None: the family computes it and
    # puts it into `Result.values`
    function: Callable[..., float] | None = None
    worst: Worst = "largest"  # which branch counts where none is named; without a target the farthest is the smallest
    # what it belongs to: one branch; all branches together, or one of them alone; the closed loop only; or no curve at
    # all
    scope: Scope = "branch"
    windowed: bool = True  # whether it looks only inside the window
    argument: str = ""  # what stands in its brackets in place of a branch: a dimension, or nothing
    of_material: bool = False  # whether it is there only where the material says something about use
    of_curve: bool = False  # whether it is there only where a target curve is
    of_parts: bool = False  # whether it is there only where the model knows the efforts of single springs and members

    @property
    def per_branch(self) -> bool:
        """Whether ``name[branch]`` means something."""
        return self.scope in ("branch", "cycle") and not self.argument

    def of(self, kind: Kind) -> Definition:
        """Return the definition in the words and units of one kind of curve."""
        text = self.definition.replace("{effort}", kind).replace("{motion}", _WORDS[kind])
        return replace(self, dimension=_PLACEHOLDERS[kind].get(self.dimension, self.dimension), definition=text)


_TABLE_3 = "[Sanchez-Salinas 2022, Table 3]"
_DING = "[Ding 2022, sec. 6.2]"
_LAN = "d is the end of the window, c where the {effort} first reaches 0.95 of that at d [Lan 2010, sec. 2]"

_IN_WINDOW = (
    Definition(
        "force_mean",
        "effort",
        f"mean {{effort}} over the points in the window, its ends included {_TABLE_3}",
        window_metrics.mean,
        "farthest-from-target",
    ),
    Definition(
        "force_sd",
        "effort",
        f"standard deviation (n - 1) of the {{effort}} over the points in the window {_TABLE_3}",
        window_metrics.standard_deviation,
    ),
    Definition("force_max", "effort", f"largest {{effort}} in the window {_TABLE_3}", window_metrics.largest),
    Definition(
        "force_min", "effort", f"smallest {{effort}} in the window {_TABLE_3}", window_metrics.smallest, "smallest"
    ),
    Definition(
        "force_ripple",
        "ratio",
        f"(max - min)/max of the {{effort}} in the window: the fluctuation of {_DING}",
        window_metrics.ripple,
    ),
    Definition(
        "half_band",
        "ratio",
        "(max - min)/(max + min) of the {effort} in the window: half the width of the narrowest band that holds it",
        window_metrics.half_band,
    ),
    Definition(
        "deviation_from_mean",
        "ratio",
        f"largest |F - mean|/mean of the {{effort}} in the window {_DING}",
        window_metrics.deviation_from_mean,
    ),
    Definition(
        "deviation_from_target",
        "ratio",
        "largest |F - target|/target of the {effort} in the window",
        window_metrics.deviation_from_target,
    ),
    Definition(
        "rms_to_target",
        "effort",
        "sqrt(mean((F - target)^2)) of the {effort} at 100 places uniform in the {motion}, "
        "the start of the window excluded [Bilancia 2019, eq. 8]",
        window_metrics.rms_to_target,
    ),
    Definition(
        "deviation_from_curve",
        "ratio",
        "largest |F - F*| of the {effort} over the largest |F*| in the window, F* the curve of `design.target` or "
        "`analysis.target`",
        window_metrics.deviation_from_curve,
        of_curve=True,
    ),
    Definition(
        "rms_to_curve",
        "effort",
        "sqrt(mean((F - F*)^2)) of the {effort} at 100 places uniform in the {motion}, the start of the window "
        "excluded, F* the curve of `design.target` or `analysis.target`",
        window_metrics.rms_to_curve,
        of_curve=True,
    ),
    Definition(
        STATIC_BALANCE,
        "ratio",
        "largest |F| of the {effort} in the window over the largest {effort} of one spring or member there, which is "
        "the derivative of its energy by the {motion}; 0 is a perfect balancer",
        window_metrics.static_balance,
        of_parts=True,
    ),
)

_RANGES = (
    Definition("range_95", "motion", f"d - c: {_LAN}", ranges.range_95, "smallest", windowed=False),
    Definition(
        "range_95_fraction", "ratio", f"(d - c)/d: {_LAN}", ranges.range_95_fraction, "smallest", windowed=False
    ),
    *(
        Definition(
            name,
            "motion",
            f"widest interval around the reference pose (default: the centre of the window; for the springs of a "
            f"slider-crank the stretched position, or half the travel of a force) in which the {{effort}} "
            f"is within {percent} % of that at the pose [Li, Hao 2019, eq. 32]",
            function,
            "smallest",
            windowed=False,
        )
        for name, percent, function in (
            ("band_range_05pct", "0.5", ranges.band_range_05pct),
            ("band_range_1pct", "1", ranges.band_range_1pct),
            ("band_range_5pct", "5", ranges.band_range_5pct),
        )
    ),
    *(
        Definition(
            name,
            "motion",
            f"{what} of the longest part of the travel on which every branch stays within the {{effort}} band (around "
            "the target, else around the mean in the window), the allowable stress and its valid range",
            function,
            "smallest",
            "cycle",
            windowed=False,
        )
        for name, what, function in (
            ("usable_stroke", "length", ranges.usable_stroke),
            ("usable_start", "start", ranges.usable_start),
            ("usable_end", "end", ranges.usable_end),
        )
    ),
)

_LOADS = (
    Definition(
        "hysteresis_area",
        "work",
        "closed integral of the {effort} over the {motion} in the window, positive where 'load' lies above 'unload' "
        "[Sanchez-Salinas 2022, sec. 3]",
        window_metrics.hysteresis_area,
        scope="loop",
    ),
    Definition("stress_max", "stress", "largest stress in the window, of all load cases", window_metrics.stress_max),
    Definition(
        "safety_factor",
        "factor",
        "allowable stress over the largest stress in the window, of all load cases; 1 or more is within the limit",
        window_metrics.safety_factor,
        "smallest",
    ),
)

_LONG_TERM = (
    Definition(
        "fatigue_life",
        "count",
        "cycles to failure between the least and the largest stress in the window, of all load cases, by the "
        "material's `fatigue` with Goodman's line",
        window_metrics.fatigue_life,
        "smallest",
        of_material=True,
    ),
    Definition(
        "force_after",
        "effort",
        "mean {effort} in the window after a hold of the time in brackets, as in `force_after[1000 h]`: it follows "
        "the material's `relaxation`",
        window_metrics.effort_after,
        "smallest",
        argument="time",
        of_material=True,
    ),
)

TABLE = (*_IN_WINDOW, *_RANGES, *_LOADS, *_LONG_TERM)
"""Every metric of the contract, in the order in which they are shown."""


@lru_cache(maxsize=4)
def _table(kind: Kind) -> tuple[Definition, ...]:
    return tuple(replace(item.of(kind), name=_name_in_words(item.name, kind)) for item in TABLE)


def _name_in_words(name: str, kind: Kind) -> str:
    return f"{kind}_{name.removeprefix('force_')}" if name.startswith("force_") else name


def definitions(kind: Kind | None = "force", extra: Iterable[Definition] = ()) -> tuple[Definition, ...]:
    """Return the metrics of one kind of curve, then those of a family.

    Parameters
    ----------
    kind : {"force", "torque"} or None
        None: both, where the kind is not known yet. Names that mean a length in one and an
        angle in the other are there twice.
    extra : iterable of Definition
        A family's own (see `values_of_family`).
    """
    own = tuple(extra)
    if kind is not None:
        return (*_table(kind), *(item.of(kind) for item in own))
    both = (*definitions("force", own), *definitions("torque", own))
    return tuple({(item.name, item.dimension): item for item in both}.values())


def values_of_family(values: Mapping[str, tuple[str, str]]) -> tuple[Definition, ...]:
    """Return definitions of the scalar results that a family computes itself: name -> (dimension, definition).

    One of something that is named in brackets has in its name what that is: ``contact_force[contact]``.
    """
    return tuple(
        Definition(plain, *about, scope="value", windowed=False, argument=argument or "")
        for (plain, argument), about in ((split_name(name), about) for name, about in values.items())
    )


def split_name(name: str) -> tuple[str, str | None]:
    """Return metric and branch of ``force_mean[load]``; the branch is None if none is named."""
    metric, bracket, rest = name.partition("[")
    return metric, rest.removesuffix("]") if bracket else None


def words(name: str) -> str:
    """Return a metric's name as people say it.

    Examples
    --------
    >>> words("force_mean[load]"), words("force_after[1000 h]")
    ('force mean on load', 'force after 1000 h')
    """
    metric, rest = split_name(name)
    after_kind = metric.partition("_")[2]
    argument = any(one.argument and one.name.partition("_")[2] == after_kind for one in TABLE)
    return metric.replace("_", " ") + (f" {'' if argument else 'on '}{rest}" if rest else "")


def unknown_metric(name: str, known: Iterable[str]) -> str:
    """Return an error that there is no such metric, and which one could be meant."""
    names = list(dict.fromkeys(known))
    other = {"force": "torque", "torque": "force"}.get(name.split("_")[0])
    swapped = f"{other}_{name.partition('_')[2]}" if other else ""
    if swapped in names:
        return f"there is no metric {name!r} on a {other} curve; did you mean {swapped!r}?"
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    hint = f"did you mean {near[0]!r}?" if near else "`cfmkit show metrics` lists them"
    return f"there is no metric {name!r}; {hint}"


_OTHER = {item.name: f"torque_{item.name.removeprefix('force_')}" for item in TABLE if item.name.startswith("force_")}


@lru_cache(maxsize=32)
def known_metrics(kind: Kind | None, extra: tuple[Definition, ...] = ()) -> tuple[Definition, ...]:
    """Return `definitions`, then the same again under other names that are accepted for them.

    Parameters
    ----------
    kind : {"force", "torque"} or None
        Of the curve; None: both, where it is not known yet.
    extra : tuple of Definition
        A family's own.
    """
    listed = definitions(kind, extra)
    return (*listed, *_others(listed))


def _others(listed: tuple[Definition, ...]) -> Iterator[Definition]:
    """Yield the metrics of torques under the names of forces, where those do not mean the same already."""
    taken = {(item.name, item.dimension) for item in listed}
    names = {torque: force for force, torque in _OTHER.items()}
    for item in listed:
        force = names.get(item.name)
        if force is not None and item.function is not None and (force, item.dimension) not in taken:
            yield replace(item, name=force)


@lru_cache(maxsize=32)
def metrics_by_name(kind: Kind | None, extra: tuple[Definition, ...] = ()) -> Mapping[str, Definition]:
    """Return `known_metrics` by name; of two that share one, the first."""
    return {item.name: item for item in reversed(known_metrics(kind, extra))}


def other_name(name: str) -> str:
    """Return what a metric of a force curve is called on a torque curve; other names stay.

    Examples
    --------
    >>> other_name("force_mean[load]"), other_name("half_band")
    ('torque_mean[load]', 'half_band')
    """
    plain, bracket, branch = name.partition("[")
    return _OTHER.get(plain, plain) + bracket + branch


def definition_of(name: str, known: Mapping[str, Definition], branches: Sequence[str] = ()) -> Definition:
    """Return what a metric is.

    Parameters
    ----------
    name : str
        With ``[branch]`` where wanted.
    known : mapping
        `metrics_by_name`.
    branches : sequence of str
        That curves may have; none if any name may occur.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no such metric, or no such branch.
    """
    plain, branch = split_name(name)
    if plain not in known:
        raise UsageError(unknown_metric(plain, known))
    if branch is not None and (reported := branch_fault(known[plain], branch, branches)):
        raise UsageError(reported)
    return known[plain]


def time_of(text: str) -> float:
    """Return the time in the brackets of a metric [s].

    Raises
    ------
    cfmkit.errors.QuantityError
        If it is none, or not above 0.
    """
    found = read_quantity(text, "time")
    if found <= 0:
        raise QuantityError(f"{text!r} is not a time of a hold: it must be above 0")
    return found


def branch_fault(meant: Definition, branch: str, branches: Sequence[str]) -> str:
    """Return what is wrong with asking for one branch of a metric; nothing if it can be had."""
    if meant.argument == "time":
        try:
            time_of(branch)
        except QuantityError as problem:
            return f"{meant.name}[{branch}]: {problem}"
        return ""
    if not meant.per_branch and not meant.argument:
        return f"{meant.name!r} does not refer to a single branch; write it without [{branch}]"
    if branches and branch not in branches:
        return f"there is no branch {branch!r}; there are {', '.join(map(repr, branches))}"
    return ""
