"""Registration of a program's own metrics, which are functions of a result, and of its own families of mechanisms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cfmkit.specs.further_metrics import register_metric

if TYPE_CHECKING:
    from collections.abc import Callable

    from cfmkit.families.base import Family
    from cfmkit.results import Result


def metric(
    function: Callable[[Result], float | None] | None = None,
    *,
    name: str | None = None,
    dimension: str | None = None,
    definition: str | None = None,
) -> Any:
    """Make a function of a result a metric of this process: for requirements, sweeps, sensitivity studies and reports.

    Parameters
    ----------
    function : callable
        Returns the value of a `Result` [SI], None or NaN where there is none.
    name : str, optional
        What requirements and tables call it; default: the name of the function.
    dimension : str, optional
        ``"force"``, ``"length"``, ``"stress"``, ...; default: a plain number.
    definition : str, optional
        One sentence; default: the first line of the function's docstring.

    Returns
    -------
    callable
        The function itself; without one, a decorator.

    Raises
    ------
    cfmkit.errors.UsageError
        If the name cannot stand in a requirement, or there is no such dimension.

    Examples
    --------
    >>> import cfmkit
    >>> @cfmkit.metric(dimension="force")
    ... def swing(result):
    ...     "largest force minus the smallest one, of both branches"
    ...     return result.curve.effort.max() - result.curve.effort.min()
    >>> spec = cfmkit.load("configs/cam.yaml").replace({"requirements": [{"metric": swing, "max": "60 N"}]})
    >>> cfmkit.analyze(spec).requirements[0].sentence
    'swing 53.67 N, allowed <= 60 N: ok'
    """
    if function is None:
        return lambda decorated: metric(decorated, name=name, dimension=dimension, definition=definition)
    register_metric(function, name, dimension, definition)
    return function


def register(record: Family) -> Family:
    """Add a family of mechanisms to those of this process, and return it.

    A second one of a name replaces the first: a cell of a notebook can be run again.

    Parameters
    ----------
    record : cfmkit.families.base.Family
        As a package of its own would offer it, see "Adding a family" in the documentation.

    Raises
    ------
    cfmkit.errors.UsageError
        If a field is of another type, or cfmkit or an installed package has a family of this name.

    Examples
    --------
    >>> import cfmkit
    >>> from cfmkit.families import family
    >>> cfmkit.register(family("cam"))
    Traceback (most recent call last):
        ...
    cfmkit.errors.UsageError: the family 'cam' cannot be registered: cfmkit itself has a family of this name
    """
    from cfmkit.families import register as registered

    return registered(record)
