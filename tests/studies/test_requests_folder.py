"""The fifty requests are what their README says: made backwards from the mechanisms beside them."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

import cfmkit
from cfmkit.families import family
from cfmkit.specs.units import read_quantity

FOLDER = Path(__file__).parents[1] / "requests"
FEASIBLE = sorted(path for path in FOLDER.glob("*.yaml") if (FOLDER / "sources" / path.name).exists())


def test_there_are_twenty_five_of_each_kind():
    assert len(FEASIBLE) == 25
    assert len(list(FOLDER.glob("*.yaml"))) == 50
    families = [path.name.partition("-")[0] for path in FEASIBLE]
    assert min(families.count(name) for name in ("beam", "cam", "crank", "vcfm")) >= 5


@pytest.mark.parametrize("name", ["cam-published", "vcfm-pla", "crank-strip", "beam-lan"])
def test_a_source_fulfils_its_request_with_a_tenth_to_spare(name):
    request = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())["suggest"]
    result = cfmkit.analyze(cfmkit.load(FOLDER / "sources" / f"{name}.yaml"))
    found = cfmkit.evaluate(result, ["force_mean", "force_ripple"])
    low, high = (float(end) for end in result.spec.analysis.window)
    room = family(result.spec.family).envelope(result)
    assert max(one.value for one in found.values() if one.dimension == "ratio") < 0.9 * read_quantity(
        request["ripple"], "ratio"
    )
    assert high - low > 1.1 * read_quantity(request["travel"], "length")
    for have, given in zip((room.across, room.along, room.depth), request["envelope"], strict=False):
        assert have < 0.9 * read_quantity(given, "length")
