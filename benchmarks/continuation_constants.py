"""What the constants of `cfmkit.elastica.continuation` decide: each is varied, and the outcomes of some paths compared.

Lengths, shares and tolerances are divided and multiplied by ten, whole numbers by two. Of every path count: status,
number of points, which points are stable, kinds of events, and forces. Prints a line for each constant whose variation
changes any of these (forces: by more than 1e-5 of the largest); the others are counted.

    OPENBLAS_NUM_THREADS=1 python benchmarks/continuation_constants.py [NAME ...]
"""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

import cfmkit
import cfmkit.elastica.continuation as room
from cfmkit.elastica import trace
from cfmkit.errors import CfmError
from cfmkit.families.beam.network_from_spec import assemble

CONFIGS = Path(__file__).parents[1] / "configs"
SHIPPED = ("cantilever", "lan2010", "lee_frame", "two_layers", "v_bifurcation", "williams_toggle")

V_BEAM = """
cfmkit: 1
family: beam
mechanism:
  material: {{youngs_modulus: 2 GPa, poisson_ratio: 0.35}}
  thickness: 0.5 mm
  width: 6 mm
  nodes:
    a: {{at: [0 mm, 0 mm], support: clamped}}
    b: {{at: [40 mm, {rise}]}}
    c: {{at: [80 mm, 0 mm], support: {support}}}
  beams: {{x: {{start: a, end: b}}, y: {{start: b, end: c, thickness: {second}}}}}
  drive: {{kind: displacement, node: b, direction: -90 deg}}
analysis: {{points: 13, travel: {travel}, branch: {branch}, tolerance: 1e-8}}
"""
V_BEAMS = [
    (rise, second, support, travel)
    for rise, second, support, travel in (
        ("3 mm", "0.5 mm", "clamped", "8 mm"),
        ("3 mm", "0.45 mm", "clamped", "8 mm"),
        ("4 mm", "0.5 mm", "pinned", "9 mm"),
        ("1.8 mm", "0.5 mm", "clamped", "5 mm"),
    )
]

COLUMN = """
cfmkit: 1
family: beam
mechanism:
  material: {{youngs_modulus: 70 GPa, poisson_ratio: 0.33}}
  thickness: 0.05 mm
  width: 5 mm
  axial: {axial}
  shear: {axial}
  nodes:
    a: {{at: [0 mm, 0 mm], support: {support}}}
    b: {{at: [100 mm, 0 mm], support: {end}, direction: 0 deg}}
  beams: {{x: {{start: a, end: b}}}}
  drive: {{kind: displacement, node: b, direction: 180 deg}}
analysis: {{points: 13, travel: 6 mm, imperfection: 0.00015 mm, tolerance: 1e-7}}
"""


def paths() -> dict[str, Any]:
    """Return networks with their drives and controls, by name."""
    texts = {f"beam_{name}": cfmkit.load(CONFIGS / f"beam_{name}.yaml") for name in SHIPPED}
    for k, (rise, second, support, travel) in enumerate(V_BEAMS):
        for branch in ("stable", "primary"):
            text = V_BEAM.format(rise=rise, second=second, support=support, travel=travel, branch=branch)
            texts[f"V-beam {k + 1}, {branch}"] = cfmkit.loads(text)
    for support, end in (("pinned", "roller"), ("clamped", "guided")):
        for axial in ("true", "false"):
            text = COLUMN.format(axial=axial, support=support, end=end)
            texts[f"{support} column, axial: {axial}"] = cfmkit.loads(text)
    found = {}
    for name, spec in texts.items():
        made = assemble(spec)
        found[name] = (made.network, made.drive(), made.control())
    return found


def outcome(path: Any) -> tuple[Any, ...]:
    """Return what counts of one path."""
    try:
        found = trace(*path)
    except CfmError as error:
        return (type(error).__name__, 0, "", "", np.zeros(0))
    kept = found.at_requested
    kinds = ", ".join(str(event.kind) for event in found.events)
    return (found.status.name, len(kept), found.stable[kept].tobytes(), kinds, found.effort[kept])


def difference(one: tuple[Any, ...], other: tuple[Any, ...]) -> str:
    """Return in which respect two outcomes differ; nothing where they do not."""
    for about, a, b in zip(("status", "points", "stability", "events"), one[:4], other[:4], strict=True):
        if a != b:
            return f"{about} {a} -> {b}" if about in ("status", "points") else about
    if not len(one[4]):
        return ""
    apart = np.nanmax(np.abs(one[4] - other[4])) / (np.nanmax(np.abs(one[4])) or 1.0)
    return f"forces by {apart:.0e}" if apart > 1e-5 else ""


def constants(module: Any) -> list[str]:
    """Return the names of a module's constants that are numbers or rows of them."""
    body = ast.parse(Path(module.__file__).read_text(encoding="utf-8")).body
    found = []
    for node in body:
        target = node.targets[0] if isinstance(node, ast.Assign) else None
        for one in target.elts if isinstance(target, ast.Tuple) else [target]:
            value = getattr(module, getattr(one, "id", ""), None)
            row = value if isinstance(value, (tuple, list)) else [value]
            if row and all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in row):
                found.append(one.id)  # type: ignore[union-attr]
    return found


def scaled(value: Any, factor: float) -> Any:
    """Return a number, or a row of them, times a factor; whole numbers times or over two."""
    if isinstance(value, (tuple, list)):
        return type(value)(scaled(x, factor) for x in value)
    return max(1, int(value * (2.0 if factor > 1 else 0.5))) if isinstance(value, int) else value * factor


def main(wanted: list[str]) -> None:
    """Print what each constant decides."""
    cases = paths()
    usual = {name: outcome(path) for name, path in cases.items()}
    modules = [
        importlib.import_module(f"{room.__name__}.{file.stem}")
        for file in sorted(Path(str(room.__file__)).parent.glob("*.py"))
        if file.stem != "__init__"
    ]
    tried = without = 0
    for module in modules:
        for name in constants(module):
            if wanted and name not in wanted:
                continue
            value, tried, told = getattr(module, name), tried + 1, False
            holders = [one for one in modules if one.__dict__.get(name) is value]
            for factor in (0.1, 10.0):
                for one in holders:
                    setattr(one, name, scaled(value, factor))
                changed = {case: difference(usual[case], outcome(path)) for case, path in cases.items()}
                for one in holders:
                    setattr(one, name, value)
                found = [f"{case}: {about}" for case, about in changed.items() if about]
                told |= bool(found)
                if found:
                    label = f"{module.__name__.rpartition('.')[2]}.{name}"
                    print(f"{label} = {value}, {'less' if factor < 1 else 'more'}: {'; '.join(found)}", flush=True)
            without += not told
    print(f"{tried} constants, {len(cases)} paths; {without} change nothing")


if __name__ == "__main__":
    main(sys.argv[1:])
