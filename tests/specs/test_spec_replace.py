"""`Spec.replace` validates only what changes: the outcome is that of the whole file with the change in it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError

import cfmkit
from cfmkit import SpecError
from cfmkit.api import load
from cfmkit.specs.block import replace_blocks
from cfmkit.specs.spec import Requirement
from cfmkit.specs.yamlio.paths import with_value

if TYPE_CHECKING:
    from cfmkit import Spec

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = sorted([*CONFIGS.glob("*.yaml"), *CONFIGS.glob("studies/*.yaml")])
SWITCHES = [
    ("mechanism.bistable.structure", "hybrid"),
    ("mechanism.safety_factor", 2.0),
    ("analysis.fidelity", "exact"),
    ("analysis.points", 33),
    ("requirements", ()),
    ("mechanism.width", "11 mm"),
]


def test_a_number_that_replaces_an_angle_is_an_angle() -> None:
    """As errors of parts do, which are numbers in SI."""
    spec = load(CONFIGS / "slider_crank_li2019.yaml").replace({"analysis.window": ("2 deg", "10 deg")})
    assert spec.replace({"analysis.window.0": 0.1}).analysis.window[0].dimension == "angle"


def replaced_whole(spec: Spec, path: str, value: Any) -> Spec | None:
    """Return the specification read from everything that was given, changed at a path; None if it is invalid."""
    data = with_value(spec.model_dump(exclude_unset=True) | {"family": spec.family}, path.split("."), value)
    try:
        return type(spec).model_validate(data, context={"as_made": False})
    except ValidationError:
        return None


def replaced(spec: Spec, path: str, value: Any) -> Spec | None:
    try:
        return spec.replace({path: value})
    except SpecError:
        return None


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_replaced_value_gives_what_the_whole_file_with_it_gives(file: Path) -> None:
    """Every number of the mechanism and the analysis in turn, and switches that other blocks depend on."""
    spec = load(file)
    given = {path: value for path, value in spec.leaves() if isinstance(value, float)}
    changes = [(path, 1.01 * value + 1e-4) for path, value in list(given.items())[::3]]
    for path, value in [*changes, *SWITCHES]:
        try:
            whole = replaced_whole(spec, path, value)
        except KeyError:
            continue
        own = replaced(spec, path, value)
        assert own == whole, path
        if own is not None and whole is not None:
            assert own.model_dump(exclude_unset=True) == whole.model_dump(exclude_unset=True), path


def test_blocks_of_a_kind_are_changed_wherever_they_are_and_not_counted_as_stated() -> None:
    spec = cfmkit.load(CONFIGS / "vcfm_ding2022.yaml")
    text = cfmkit.dumps(spec)
    halved = replace_blocks(
        spec, type(spec.mechanism.material), lambda block: block.derive(youngs_modulus=0.5 * block.modulus)
    )
    assert halved.mechanism.material.modulus == 0.5 * spec.mechanism.material.modulus
    assert cfmkit.dumps(halved) == text
    assert halved.mechanism.bistable is spec.mechanism.bistable
    assert halved.analysis is spec.analysis
    assert replace_blocks(spec, Requirement, lambda block: block) is spec
    before, after = (cfmkit.analyze(each) for each in (spec, halved))
    mean = cfmkit.evaluate(before, ["force_mean"])["force_mean"].value
    assert cfmkit.evaluate(after, ["force_mean"])["force_mean"].value == pytest.approx(0.5 * mean, rel=1e-6)
