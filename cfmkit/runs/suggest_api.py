"""The function `cfmkit.suggest` for scripts and notebooks: requirements from keywords or a file, ranked proposals."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from cfmkit.api import given_arguments
from cfmkit.families.run_control import Run, read_time

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.runs.notebook_suggestions import SuggestionsView


def suggest(
    request: str | os.PathLike[str] | None = None,
    *,
    seed: int = 0,
    jobs: int = 1,
    time_budget: str | float | None = 180.0,
    force: str | Sequence[str] | None = None,
    torque: str | Sequence[str] | None = None,
    travel: str | None = None,
    angle: str | None = None,
    ripple: str | float | None = None,
    envelope: Sequence[str] | None = None,
    material: str | Sequence[str] | None = None,
    process: str | None = None,
    adjustable: Sequence[str] | None = None,
    hysteresis: str | float | None = None,
    cycles: int | None = None,
    min_yield: str | float | None = None,
    safety: str | float | None = None,
    springs: str | Sequence[str] | None = None,
    overload: str | None = None,
    prefer: Sequence[str] | None = None,
) -> SuggestionsView:
    """Return mechanisms of every family that meet the requirements, ranked, and those not judged in full.

    Parameters
    ----------
    request : path-like, optional
        A YAML file with a block `suggest`.
    seed : int
        Random seed.
    jobs : int
        Processes; 1: only this one, in which a long job cannot be stopped when the time budget ends.
    time_budget : str or float, optional
        A text with its unit (``"20 s"``, ``"2 min"``), or a number [s]; None: no limit.
    force, torque : str or sequence of str, optional
        To keep constant, ``"20 N"``, or a band of them. These and the next ones replace the keys of the file.
    travel, angle : str, optional
        Over which the force, or the torque, is constant.
    ripple : str or float, optional
        Largest (max - min)/max over the travel.
    envelope : sequence of str, optional
        Box that it stays in, ``["80 mm", "60 mm", "6 mm"]``: across the travel, along it, and the depth.
    material : str or sequence of str, optional
        Allowed materials.
    process : str, optional
        How it is made.
    adjustable : sequence of str, optional
        Range over which the constant force must be adjustable, its lowest and its highest value.
    hysteresis : str or float, optional
        Largest energy loss of a cycle, as a share of its work.
    cycles : int, optional
        Required life.
    min_yield : str or float, optional
        Smallest share of manufactured parts that meet all requirements, as 0.95 or ``"95 %"``: the key `yield`.
    safety : str or float, optional
        Smallest safety factor.
    springs : str or sequence of str, optional
        Which springs may be used.
    overload : str, optional
        Force along the travel that a rigid end stop has to bear.
    prefer : sequence of str, optional
        What decides the order: ``size``, ``ripple``, ``parts``, ``stress``, ``depth``.

    Raises
    ------
    cfmkit.errors.SpecError
        If the request contradicts itself, or is malformed.

    Examples
    --------
    >>> import cfmkit
    >>> found = cfmkit.suggest(force="10 kN", travel="10 mm", envelope=["20 mm", "20 mm", "1 mm"], material="pla")
    >>> len(found.proposals), len(found.answers)
    (0, 4)
    """
    from cfmkit.runs.notebook_suggestions import SuggestionsView
    from cfmkit.runs.read_suggest_file import read_request
    from cfmkit.studies.pool import Pool
    from cfmkit.studies.serial_and_cluster_executors import serial
    from cfmkit.studies.suggest.search import suggest as search_families

    def format_value(value: Any) -> str:
        return "[" + ", ".join(map(format_value, value)) + "]" if isinstance(value, list | tuple) else str(value)

    keys = given_arguments(
        force=force,
        torque=torque,
        travel=travel,
        angle=angle,
        ripple=ripple,
        envelope=envelope,
        material=material,
        process=process,
        adjustable=adjustable,
        hysteresis=hysteresis,
        cycles=cycles,
        safety=safety,
        springs=springs,
        overload=overload,
        prefer=prefer,
    )
    keys |= {} if min_yield is None else {"yield": min_yield}
    name = None if request is None else os.fspath(request)
    block = read_request(name, {key: format_value(value) for key, value in keys.items()}, mark="")
    run = Run(seed, time_budget=read_time(time_budget), executor=serial if jobs == 1 else Pool(jobs))
    return SuggestionsView.answering(search_families(block.request(), run, block.prefer), block)
