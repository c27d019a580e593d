"""A sweep over whatever can vary, numbers, words and switches, has in each row what an analysis of that point says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.specs.units import format_quantity, to_border
from cfmkit.studies import FIXED_BLOCKS, CannotVary, leaf, paths

CONFIGS = Path(__file__).parents[2] / "configs"
STEMS = sorted(
    str(file.relative_to(CONFIGS).with_suffix("")) for file in CONFIGS.rglob("*.yaml") if "cfmkit:" in file.read_text()
)
BEYOND_REASON = (-1.0, 0.0, 30.0)
N_POINTS = 4
CLOSED_FIDELITIES = ("quasi-static", "dynamic", "truss", "analytic", "prb")
"""Of others extremes of traced curves keep the root of what is left in the last digits of forces."""


def draw_values(spec, path, draw):
    """Return values of a path as a user writes them, one in six beyond reason; None if nothing is known of it."""
    try:
        place, value = leaf(type(spec), path), spec.get_value(path)
    except (CannotVary, KeyError):
        return None
    if place.kind == "switch":
        return draw.permutation([True, False] * 2).tolist()
    if place.kind == "word":
        words = [word for word in place.choices if word not in (None, "solid")]
        return draw.choice(words, N_POINTS).tolist() if len(words) > 1 else None
    if not isinstance(value, float) or not value:
        return None
    factors = np.where(
        draw.random(N_POINTS) < 1 / 6, draw.choice(BEYOND_REASON, N_POINTS), draw.uniform(0.97, 1.03, N_POINTS)
    )
    if place.quantity is None:
        return (value * factors).tolist()
    dimension = getattr(value, "dimension", place.quantity.dimensions[0])
    return [format_quantity(value * factor, dimension) for factor in factors.tolist()]


def vary_anything(spec, draw):
    """Return two or three paths, one of them a word or a switch where there is one, and their values."""
    numbers = [path for path, _ in spec.leaves()]
    others = [
        path for path in paths(type(spec)) if "NAME" not in path and leaf(type(spec), path).kind in ("word", "switch")
    ]
    chosen = {}
    for known, count in ((others, 1), (numbers, 3)):
        for path in draw.permutation([path for path in known if path.split(".")[0] not in (*FIXED_BLOCKS, "design")]):
            if len(chosen) < count and (values := draw_values(spec, str(path), draw)):
                chosen[str(path)] = values
    return chosen


def analyze(spec, changes):
    """Return status, names of warnings, metrics in units of tables, and whether the requirements are met."""
    try:
        result = cfmkit.analyze(spec.replace(changes))
    except cfmkit.CfmError as error:
        return ("invalid" if error.exit_code == 3 else "no_equilibrium"), None, {}, None
    metrics = (
        {name: item for name, item in result.metrics.items() if item.dimension != "text"}
        if result.status.usable
        else {}
    )
    numbers = {
        name: np.nan if item.value is None else to_border(item.value, item.dimension) for name, item in metrics.items()
    }
    return (
        result.status.key,
        [*{item.name: 0 for item in result.warnings}],
        numbers,
        all(item.ok for item in result.requirements),
    )


@pytest.mark.slow
@pytest.mark.parametrize("stem", STEMS)
def test_a_row_of_a_sweep_over_anything_is_an_analysis(stem):
    spec = cfmkit.load(CONFIGS / f"{stem}.yaml").replace({"sweep": None, "sensitivity": None})
    vary = vary_anything(spec, np.random.default_rng(39))
    table = cfmkit.sweep(spec, vary=vary, combine="zip").table
    rtol = 1e-11 if spec.fidelity in CLOSED_FIDELITIES else 1e-8
    columns = {column.name: column.cells() for column in table.columns}
    for k in range(N_POINTS):
        status, warnings, numbers, is_met = analyze(spec, {path: values[k] for path, values in vary.items()})
        assert columns["status"][k] == status, (vary, k)
        if warnings is not None:
            assert columns["warnings"][k] == ("; ".join(sorted(warnings)) or None), (vary, k)
        if numbers:
            assert columns["requirements_met"][k] == str(is_met).lower() or not spec.part_requirements
        for name in numbers.keys() & columns.keys():
            size = max((abs(cell) for cell in columns[name] if cell is not None), default=0.0)
            value = np.nan if columns[name][k] is None else columns[name][k]
            assert value == pytest.approx(numbers[name], rel=0.0, abs=max(rtol * size, 1e-11), nan_ok=True), (
                name,
                vary,
                k,
            )
