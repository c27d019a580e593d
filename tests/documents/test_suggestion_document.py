"""The page of `suggest`: what its notes say of several proposals."""

from cfmkit.documents.document import Written
from cfmkit.documents.suggestion_document import _common_notes, document_of
from cfmkit.documents.terminal import page, print_blocks
from cfmkit.errors import ExitCode


def test_a_warning_of_several_proposals_is_one_note_with_a_command_that_exists():
    """The command repeated the whole sentence: `cfmkit show run_in: the force begins at zero`."""
    warned = (("run_in: from 1 mm",), ("run_in: from 2 mm", "wide_beam +2 %"), ("wide_beam +2 %",))
    stops = ((), ("end stop, rigid: it carries 50 N", "friction assumed"), ())
    shown = zip(warned, stops, strict=True)
    notes = list(_common_notes([{"unjudged": ("yield",), "warnings": texts, "notes": more} for texts, more in shown]))
    assert [(note.word, note.text) for note in notes] == [
        ("no. 1-3", "yield"),
        ("no. 2", "end stop, rigid: it carries 50 N"),
        ("no. 1-2", "run_in (see `cfmkit show run_in`)"),
        ("no. 2-3", "wide_beam +2 % (see `cfmkit show wide_beam`)"),
    ]


def test_a_proposal_whose_files_were_not_made_in_time_is_named(capsys):
    one = {"family": "cam", "variant": "2 springs", "mean": 20.0, "ripple": 0.01, "across": 1.0, "along": 2.0}
    one |= {"depth": None, "safety_factor": None, "parts": 3, "hysteresis": None, "model": "quasi-static"}
    one |= {"unjudged": [], "warnings": [], "verdict": "meets", "life": None, "yield": None}
    both = [one | {"folder": "1-cam-2-springs"}, one | {"folder": "10-cam"}]
    data = {"message": "2 mechanisms meet the requirements", "proposals": both, "suggest": {}, "near_misses": []}
    data |= {"unjudged": [], "order": ["size"]}
    written = Written("out", ("1-cam-2-springs/design.yaml", "10-cam/design.yaml", "10-cam/metrics.json"))
    document = document_of(data | {"families": [], "warnings": []}, ExitCode.OK, written)
    notes = [note.text for note in document.notes if note.word == "note"]
    assert len(notes) == 1
    assert "no time was left for the curve and figures of 1-cam-2-springs" in notes[0]


def test_the_page_says_how_the_search_ended_and_v_how_long_it_took():
    text = "3 mechanisms meet the requirements; the time budget ended the search before everything was tried"
    data = {key: [] for key in ("proposals", "unjudged", "near_misses", "order", "families", "warnings")}
    document = document_of(data | {"message": text, "suggest": {}}, ExitCode.OK, Written("out", (), 94.7))
    short, full = (print_blocks(page(document, 80, everything), 80) for everything in (False, True))
    assert short.startswith("suggest   3 mechanisms meet the requirements\n")
    assert "the time budget ended the search before everything was tried" in " ".join(short.split())
    assert "94.70 s" in full
