"""The page of `suggest`: what its notes say of several proposals."""

from cfmkit.documents.suggestion_document import _remarks


def test_a_warning_of_several_proposals_is_one_note_with_a_command_that_exists():
    """The command repeated the whole sentence: `cfmkit show run_in: the force begins at zero`."""
    warned = (("run_in: from 1 mm",), ("run_in: from 2 mm", "wide_beam +2 %"), ("wide_beam +2 %",))
    notes = list(_remarks([{"unjudged": ("yield",), "warnings": texts} for texts in warned]))
    assert [(note.word, note.text) for note in notes] == [
        ("no. 1-3", "yield"),
        ("no. 1-2", "run_in (see `cfmkit show run_in`)"),
        ("no. 2-3", "wide_beam +2 % (see `cfmkit show wide_beam`)"),
    ]
