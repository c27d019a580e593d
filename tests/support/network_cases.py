"""Networks as lines of a file, with what is known of their paths: `tests/cases/networks.jsonl`.

A line is one case: a network, a drive, how it is followed, and the values of its path that `observe` takes.
`tools/freeze_networks.py` wrote the file.
"""

from __future__ import annotations

import json
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import numpy as np

import cfmkit.elastica as elastica
from cfmkit.elastica import NetworkMasses, frequencies

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

FILE = File(__file__).parents[1] / "cases" / "networks.jsonl"
DENSITY = 1000.0  # [kg/m3] of every beam, where frequencies are taken
N_FREQUENCIES = 3
MAX_POINTS = 12
"""Points of a path of which values are kept: of more, evenly picked ones, the last among them."""
TYPES = {name: getattr(elastica, name) for name in elastica.__all__}


def to_json(value: Any) -> Any:
    """Return a record of the engine's model as JSON values; fields at their defaults are left out."""
    if is_dataclass(value):
        stated = {"is": type(value).__name__}
        for field in fields(value):
            own = getattr(value, field.name)
            default = field.default_factory() if field.default_factory is not MISSING else field.default
            if default is MISSING or not _is_same(own, default):
                stated[field.name] = to_json(own)
        return stated
    if isinstance(value, np.ndarray | tuple | list):
        return [to_json(item) for item in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if hasattr(value, "items"):
        return {name: to_json(item) for name, item in value.items()}
    return value.item() if isinstance(value, np.generic) else value


def from_json(value: Any) -> Any:
    """Return the record that `to_json` was given."""
    if isinstance(value, dict):
        known = {name: from_json(item) for name, item in value.items() if name != "is"}
        return TYPES[value["is"]](**known) if "is" in value else known
    if isinstance(value, list):
        return tuple(from_json(item) for item in value)
    return value


def _is_same(value: Any, default: Any) -> bool:
    return type(value) is type(default) and bool(value == default)


def read_cases() -> Iterator[Mapping[str, Any]]:
    """Yield the cases of the file."""
    with FILE.open(encoding="utf-8") as lines:
        yield from map(json.loads, lines)


def pick(path: elastica.Path) -> Any:
    """Return indices of the requested points whose values are compared."""
    at = path.at_requested
    return at if len(at) <= MAX_POINTS else at[np.linspace(0, len(at) - 1, MAX_POINTS).round().astype(int)]


def observe(path: elastica.Path) -> dict[str, Any]:
    """Return what is compared of a path: SI values at picked requested points, in path order.

    `motion` and `reaction` hold every node that no link moves; `stress` the largest of each beam; `frequencies` [Hz]
    those at the last picked point, the drive held, if the path is stable there and no load follows.
    """
    at = pick(path)
    network = path.network
    seen: dict[str, Any] = {
        "status": path.status.name,
        "points": len(path.at_requested),
        "requested": path.requested[at].tolist(),
        "effort": path.effort[at].tolist(),
        "unstable": path.unstable[at].tolist(),
        "events": [[event.kind, event.drive, event.before, event.after] for event in path.events],
        "motion": {}, "reaction": {}, "stress": {}, "frequencies": [],
    }  # fmt: skip
    if not len(at):
        return seen
    for name in network.nodes:
        if not network.is_moved_by_link(name):
            seen["motion"][name] = path.motion(name)[at].tolist()
            seen["reaction"][name] = path.reaction(name)[at].tolist()
    for name, stress in zip(network.beams, path.beam_stresses()[0], strict=True):
        seen["stress"][name] = stress[at].tolist()
    loads = (*network.loads, *path.load_case.loads)
    if path.unstable[at[-1]] == 0 and not any(getattr(load, "follows", False) for load in loads):
        masses = NetworkMasses(dict.fromkeys(network.beams, DENSITY))
        held = frequencies(path, masses, N_FREQUENCIES, [int(at[-1])]).held[0]
        seen["frequencies"] = held[np.isfinite(held)].tolist()
    return seen


def rounded(values: Any) -> Any:
    """Return observed values with twelve significant digits: what the file holds."""
    if isinstance(values, dict):
        return {name: rounded(item) for name, item in values.items()}
    if isinstance(values, list | tuple):
        return [rounded(item) for item in values]
    return float(f"{values:.12g}") if isinstance(values, float) else values


def differences(seen: Mapping[str, Any], known: Mapping[str, Any], tolerance: float, length: float) -> list[str]:
    """Return in words where observed values differ from known ones; numbers by `tolerance` of the path's largest.

    Motions are compared with the largest of any node, places in units of `length` [m], reactions with the largest force
    or moment over `length`, drives of events with the largest known one. Stresses and frequencies may differ by
    ten times the tolerance: they are derivatives of the path.
    """
    wrong = [
        f"{name}: {seen[name]} for {known[name]}"
        for name in ("status", "points", "requested")
        if seen[name] != known[name]
    ]
    stable = [[count == 0 for count in values["unstable"]] for values in (seen, known)]
    wrong += ["stability of points"] if stable[0] != stable[1] else []
    if [event[0] for event in seen["events"]] != [event[0] for event in known["events"]]:
        wrong.append(f"events: {seen['events']} for {known['events']}")
    if wrong:
        return wrong
    size = np.array([length, length, 1.0])
    compared: list[tuple[str, Any, Any, float]] = [("effort", seen["effort"], known["effort"], tolerance)]
    for name, scale in (("motion", 1 / size), ("reaction", size / length)):
        nodes = list(known[name])
        values = [np.reshape([record[name][node] for node in nodes], (-1, 3)) * scale for record in (seen, known)]
        compared.append((name, *values, tolerance))
    beams = list(known["stress"])
    compared.append(
        ("stress", *([record["stress"][beam] for beam in beams] for record in (seen, known)), 10 * tolerance)
    )
    compared.append(("frequencies", seen["frequencies"], known["frequencies"], 10 * tolerance))
    drives = [[event[1] for event in record["events"]] for record in (seen, known)]
    compared.append(("events", *drives, max(1e-5, tolerance)))
    for name, found, right, allowed in compared:
        found, right = np.asarray(found, float), np.asarray(right, float)
        largest = float(np.abs(right).max(initial=0.0))
        error = float(np.abs(found - right).max(initial=0.0)) if found.shape == right.shape else np.inf
        if error > allowed * largest:
            wrong.append(f"{name}: by {error / largest:.1e} of the largest")
    return wrong
