"""Move the notes of `changes/` into the newest version of CHANGELOG.md, and delete their files."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
HEADINGS = {
    "files": "### Change these in your files and scripts\n",
    "numbers": "### Numbers that change, and why\n",
    "new": "### New\n",
}


def join(changelog, section, note):
    """Return a changelog with a note behind the last one of its kind in a section of the newest version."""
    before, heading, behind = changelog.partition(HEADINGS[section])
    if not heading:
        raise ValueError(f"CHANGELOG.md has no section {HEADINGS[section].strip()!r}")
    end = behind.find("\n#") + 1 or len(behind)
    lines = behind[:end].splitlines(keepends=True)
    last = max((number for number, line in enumerate(lines, 1) if line[:2] == note[:2]), default=len(lines))
    while last < len(lines) and lines[last].startswith("  "):  # the rest of a note of several lines
        last += 1
    return before + heading + "".join([*lines[:last], note.strip() + "\n", *lines[last:]]) + behind[end:]


def notes(folder):
    """Return (section, text, file) of each note in a folder."""
    files = sorted(file for file in folder.glob("*.md") if file.name != "README.md")
    return [(file.name.partition("_")[0], file.read_text(encoding="utf-8"), file) for file in files]


if __name__ == "__main__":
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for section, note, file in notes(ROOT / "changes"):
        text = join(text, section, note)
        (ROOT / "CHANGELOG.md").write_text(text, encoding="utf-8")
        file.unlink()
