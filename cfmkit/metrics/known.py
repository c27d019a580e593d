"""Which metrics a name may mean: those of one kind of curve, those of a family, and other names for them.

On a torque curve ``force_ripple`` is accepted for ``torque_ripple``: whoever compares
mechanisms need not know what drives them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from cfmkit.errors import UsageError
from cfmkit.metrics.table import TABLE, Definition, definitions, split_name, unknown_metric

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.curves import Kind

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
    if branch is not None and (told := branch_fault(known[plain], branch, branches)):
        raise UsageError(told)
    return known[plain]


def branch_fault(meant: Definition, branch: str, branches: Sequence[str]) -> str:
    """Return what is wrong with asking for one branch of a metric; nothing if it can be had."""
    if not meant.per_branch:
        return f"{meant.name!r} is not a matter of one branch; write it without [{branch}]"
    if branches and branch not in branches:
        return f"there is no branch {branch!r}; there are {', '.join(map(repr, branches))}"
    return ""
