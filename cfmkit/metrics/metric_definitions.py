"""The table of constant-force metrics by their names; definitions stand beside the functions.

A metric of a force curve is called ``force_mean``; of a torque curve, where it is a torque over an angle,
``torque_mean``. Names without ``force_`` are the same for both. On a torque curve ``force_ripple`` is accepted for
``torque_ripple``: whoever compares mechanisms need not know what drives them.

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
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from cfmkit.errors import QuantityError, UsageError
from cfmkit.metrics import ranges, window_metrics
from cfmkit.metrics.definition import Definition
from cfmkit.specs.units import read_quantity

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from cfmkit.curves import Kind


def refuse_namesakes(table: Sequence[Definition]) -> tuple[Definition, ...]:
    """Return a table of metrics; raises UsageError if two of them have one name."""
    names = [item.name for item in table]
    if twice := next((name for name in names if names.count(name) > 1), ""):
        raise UsageError(f"two metrics are called {twice!r}: one of them needs another name")
    return tuple(table)


METRIC_TABLE = refuse_namesakes(
    (
        *window_metrics.IN_WINDOW,
        *ranges.TRAVEL_METRICS,
        *window_metrics.LOSS_AND_STRESS_METRICS,
        *window_metrics.LONG_TERM,
    )
)
"""Every metric of the contract, in the order in which they are shown."""


@lru_cache(maxsize=4)
def _table(kind: Kind) -> tuple[Definition, ...]:
    return tuple(replace(item.state_for_kind(kind), name=_name_for_kind(item.name, kind)) for item in METRIC_TABLE)


def _name_for_kind(name: str, kind: Kind) -> str:
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
    own_metrics = tuple(extra)
    if kind is not None:
        return (*_table(kind), *(item.state_for_kind(kind) for item in own_metrics))
    both = (*definitions("force", own_metrics), *definitions("torque", own_metrics))
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
    argument = any(
        definition.argument and definition.name.partition("_")[2] == after_kind for definition in METRIC_TABLE
    )
    return metric.replace("_", " ") + (f" {'' if argument else 'on '}{rest}" if rest else "")


def unknown_metric(name: str, known_names: Iterable[str]) -> str:
    """Return an error that there is no such metric, and which one could be meant."""
    names = list(dict.fromkeys(known_names))
    other_kind = {"force": "torque", "torque": "force"}.get(name.split("_")[0])
    swapped = f"{other_kind}_{name.partition('_')[2]}" if other_kind else ""
    if swapped in names:
        return f"there is no metric {name!r} on a {other_kind} curve; did you mean {swapped!r}?"
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    hint = f"did you mean {close[0]!r}?" if close else "`cfmkit show metrics` lists them"
    return f"there is no metric {name!r}; {hint}"


_TORQUE_NAMES = {
    item.name: f"torque_{item.name.removeprefix('force_')}" for item in METRIC_TABLE if item.name.startswith("force_")
}


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
    names = {torque: force for force, torque in _TORQUE_NAMES.items()}
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
    return _TORQUE_NAMES.get(plain, plain) + bracket + branch


def definition_of(name: str, definitions: Mapping[str, Definition], branches: Sequence[str] = ()) -> Definition:
    """Return what a metric is.

    Parameters
    ----------
    name : str
        With ``[branch]`` where wanted.
    definitions : mapping
        `metrics_by_name`.
    branches : sequence of str
        That curves may have; none if any name may occur.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no such metric, or no such branch.
    """
    plain, branch = split_name(name)
    if plain not in definitions:
        raise UsageError(unknown_metric(plain, definitions))
    if branch is not None and (reported := branch_fault(definitions[plain], branch, branches)):
        raise UsageError(reported)
    return definitions[plain]


def time_of(text: str) -> float:
    """Return the time in the brackets of a metric [s].

    Raises QuantityError if it is none, or not above 0.
    """
    duration = read_quantity(text, "time")
    if duration <= 0:
        raise QuantityError(f"{text!r} is not a time of a hold: it must be above 0")
    return duration


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
