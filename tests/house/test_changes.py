"""`tools/join_changes.py`: each note of a change comes into its section of the newest version."""

import runpy
from pathlib import Path

import pytest

pytestmark = pytest.mark.lists
ROOT = Path(__file__).parents[2]
TOOL = runpy.run_path(str(ROOT / "tools/join_changes.py"))
CHANGELOG = """# Changes

## 0.2

### Change these in your files and scripts

| 0.1 | 0.2 |
|---|---|
| `a` | `b` |

A warning is gone.

### New

- One,
  of two lines.
- Two.

## 0.1

### New

- Zero.
"""


@pytest.mark.parametrize(
    ("section", "note", "behind"),
    [("new", "- Three,\n  longer.", "- Two.\n"), ("files", "| `c` | `d` |\n", "| `a` | `b` |\n")],
)
def test_a_note_stands_behind_the_last_of_its_section(section, note, behind):
    joined = TOOL["join"](CHANGELOG, section, note)
    assert joined == CHANGELOG.replace(behind, f"{behind}{note.strip()}\n")


def test_a_note_follows_one_of_several_lines():
    shorter = CHANGELOG.replace("- Two.\n", "")
    assert "of two lines.\n- Two.\n\n## 0.1" in TOOL["join"](shorter, "new", "- Two.")


def test_every_note_has_a_section_and_begins_as_its_neighbours_do():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for section, note, file in TOOL["notes"](ROOT / "changes"):
        assert section in TOOL["HEADINGS"], file
        assert note.startswith("| " if section == "files" else "- "), file
        assert note.strip() in TOOL["join"](changelog, section, note)
