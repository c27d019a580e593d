"""`cfmkit show` and `cfmkit docs --search` lead from common words to the names that cfmkit uses."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cfmkit.cli import guide, show_topics
from cfmkit.cli.show_by_meaning import explain_by_meaning
from cfmkit.cli.verbs import names as verbs

pytestmark = pytest.mark.lists

REFERENCE = (Path(__file__).parents[2] / "docs" / "reference.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("word", "name", "page"),
    [
        ("counterbalance", "static_balance", "howto"),
        ("bill of materials", "design.catalogue", "springs"),
        ("BOM", "design.catalogue", "springs"),
        ("creep", "force_after", "durability"),
        ("gripper", "first_contact", "contact"),
        ("hysteresis", "hysteresis_area", "suggest"),
        ("lifetime", "fatigue_life", "durability"),
        ("S-N", "fatigue_life", "durability"),
        ("bounding box", "envelope_x", "suggest"),
        ("Factor of Safety", "safety_factor", "vcfm"),
        ("natural frequencies", "frequency_held_min", "beam"),
        ("living hinges", "", "slider_crank_beams"),
        ("cite", "", "reports"),
        ("notch", "stress_concentration_max", "solid"),
        ("parts lists", "design.catalogue", "springs"),
    ],
)
def test_a_common_word_leads_to_the_name_and_the_page(word, name, page):
    explained = explain_by_meaning(word)
    assert explained is not None
    assert name in {"", *(one["name"] for one in explained.data["names"])}
    assert page in [one["page"] for one in explained.data["pages"]][:5]
    assert page in [section.page for section in guide.search(word)][:8]


@pytest.mark.parametrize(
    ("words", "page"), [("own metric", "python"), ("own material", "howto"), ("compare with measurement", "measuring")]
)
def test_several_words_that_are_no_phrase_lead_to_the_sections_that_name_all_of_them(words, page):
    assert page in [section.page for section in guide.search(words)][:3]


def test_every_target_of_a_synonym_is_explained():
    """It is a term, a name that `show` knows, a verb, a word of a verb's options, or a file of the reference."""
    targets = {target for _, cell in guide.read_glossary("synonym") for target in cell.split(", ")}
    known = {*guide.read_terms(), *show_topics.names(), *verbs(), "contact_force", "tare", "solid", "references"}
    assert len(targets) > 60
    assert {target for target in targets - known if f"`{target}`" not in REFERENCE} == set()


def test_no_synonym_is_stated_twice_or_hides_a_term():
    synonyms = [word.lower() for words, _ in guide.read_glossary("synonym") for word in words]
    assert len(synonyms) > 120
    assert sorted({word for word in synonyms if synonyms.count(word) > 1}) == []
    assert {word for word in synonyms if word in guide.read_terms()} == set()


def test_a_term_is_explained_with_the_names_that_have_it():
    data = explain_by_meaning("hysteresis").data
    assert data["terms"][0]["meaning"].startswith("difference between loading and unloading")
    assert "hysteresis_area" in {one["name"] for one in data["names"]}
    assert show_topics.find_page("envelope").data["terms"][0]["name"] == "envelope"


def test_words_that_mean_nothing_here_are_refused():
    assert explain_by_meaning("qqzx") is None
    assert explain_by_meaning(" ") is None
    assert guide.search("qqzx") == []


def test_a_key_of_several_blocks_is_shown_once():
    paths = [one["name"] for one in explain_by_meaning("creep").data["names"] if one["kind"] == "key"]
    assert paths == ["mechanism.material.relaxation"]


def test_sections_are_found_by_their_headings_and_comments_in_code_are_none():
    assert guide.search("wide beams")[0][:2] == ("beam", "Wide beams")
    headings = {section.heading for section in guide.search("yaml")}
    assert not [heading for heading in headings if re.match(r"fidelity|displacement, force", heading)]
