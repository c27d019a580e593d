"""Templates of `cfmkit new`."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from cfmkit.cli.verbs.new import complete_template, template
from cfmkit.families import family
from cfmkit.specs import keys

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
