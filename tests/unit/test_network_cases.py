"""Every case of `tests/cases/networks.jsonl` keeps its path: forces, events, stability, stresses, frequencies."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from network_cases import differences, from_json, observe, read_cases

from cfmkit.elastica import trace

if TYPE_CHECKING:
    from collections.abc import Mapping

CASES = {case["name"]: case for case in read_cases()}
EVERY = 8
"""One case of so many is tried at every run, the others with the slow tests."""
TOLERANCE = 1e-6  # of what is compared: a path at 1e-9 has a true error of some 1e-7 where tension is high


@pytest.mark.parametrize(
    "name", [name if k % EVERY == 0 else pytest.param(name, marks=pytest.mark.slow) for k, name in enumerate(CASES)]
)
def test_the_path_is_as_it_was(name: str) -> None:
    case: Mapping[str, Any] = CASES[name]
    network, drive, control = (from_json(case[part]) for part in ("network", "drive", "control"))
    path = trace(network, drive, replace(control, tolerance=case["frozen_at"]))
    length = float(np.mean([fitted.length for fitted in path.fits.values()]))
    assert differences(observe(path), case["expected"], TOLERANCE, length) == []
