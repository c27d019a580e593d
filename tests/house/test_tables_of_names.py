"""What is added in one place is known everywhere: templates, methods of studies, ways to draw, requests, materials."""

import re
from dataclasses import replace

import numpy as np
import pytest
from sources import PACKAGE

from cfmkit.cli.verbs.new import complete_template, template
from cfmkit.cli.verbs.suggest import REQUEST_KEYS
from cfmkit.families import family
from cfmkit.numerics.unit_cube_samples import SAMPLE_KINDS, SampleKind, sample_unit_cube
from cfmkit.plots import sensitivity as sensitivity_pictures
from cfmkit.runs.suggest_api import read_request
from cfmkit.specs.keys_and_schema import keys
from cfmkit.specs.sensitivity_methods import METHOD_NAMES
from cfmkit.studies.sensitivity.method import method_named
from cfmkit.studies.suggest.spec import SuggestBlock

pytestmark = pytest.mark.lists


@pytest.mark.parametrize("name", ["beam", "cam", "slider-crank", "vcfm"])
def test_a_key_that_a_template_leaves_out_is_added_to_its_block_as_a_comment(name):
    known, text = keys(family(name).spec_type), template(name)
    assert complete_template(text, known) == text
    (band,) = (key for key in known if key.path == "analysis.band")
    new = replace(band, path="analysis.loudness", default="5 dB", description="how loud it is; default: quiet")
    deeper = replace(band, path="analysis.solid.loudness")
    needed = replace(band, path="analysis.needed", required=True)
    longer = complete_template(text, (*known, new, deeper, needed))
    line = "  # loudness: 5 dB    # how loud it is\n"
    assert longer.replace(line, "") == text
    before = longer[: longer.index(line)]
    assert re.findall(r"(?m)^(\w+):", before)[-1] == "analysis"


@pytest.mark.parametrize("name", METHOD_NAMES)
def test_a_method_of_sensitivity_has_its_module_and_its_figures(name):
    method = method_named(name)
    assert method.count_points(16, 3, 2) > 0
    assert method.indices
    assert all(callable(getattr(sensitivity_pictures, function)) for function in method.pictures.values())


def test_every_way_to_draw_fills_the_unit_cube_evenly(monkeypatch):
    monkeypatch.setitem(SAMPLE_KINDS, "halton", SampleKind("halton", "a Halton sequence", "Halton"))
    for name in SAMPLE_KINDS:
        points = sample_unit_cube(name, 3, 256, 7)
        assert points.shape == (256, 3)
        counts = np.stack([np.histogram(column, 8, (0.0, 1.0))[0] for column in points.T])
        assert np.abs(counts - 32).max() <= 2  # at random some of the 24 bins would miss by ten
        assert np.array_equal(points, sample_unit_cube(name, 3, 256, 7))


def test_every_key_of_a_request_is_an_option_and_reaches_families_under_its_name():
    assert set(REQUEST_KEYS) == set(SuggestBlock.model_fields)
    stated = {
        "force": "20 N", "travel": "10 mm", "ripple": "3 %", "envelope": "[100 mm, 90 mm, 20 mm]", "process": "laser",
        "adjustable": "[15 N, 25 N]", "hysteresis": "7 %", "springs": "custom", "safety": "1.7", "cycles": "12345",
        "overload": "60 N",
    }  # fmt: skip
    request = read_request(None, stated).request()
    assert (request.travel, request.ripple, request.envelope) == (0.01, 0.03, (0.1, 0.09, 0.02))
    assert (request.process, request.adjustable, request.hysteresis) == ("laser", (15.0, 25.0), 0.07)
    assert (request.springs, request.safety, request.cycles, request.overload) == ("custom", 1.7, 12345, 60.0)


def test_families_read_the_modulus_of_a_material_and_how_it_is_cut_in_one_place():
    """What changes with the conditions of an analysis is changed there, and reaches all."""
    twice = re.compile(r"material\.(youngs_modulus|poisson_ratio)\b(?!\")|\.part or \w+\(")
    sources = [path for path in (PACKAGE / "families").rglob("*.py") if not path.name.endswith("spec.py")]
    read = {f"{path.name}: {line.strip()}" for path in sources for line in path.read_text("utf-8").split("\n")
            if twice.search(line) and not re.search(r"[\"'].*material\.youngs_modulus.*[\"']", line)}  # fmt: skip
    assert {line for line in read if '"' not in line} == set()
