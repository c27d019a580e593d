"""Papers behind a family, read from the BibTeX file in its folder."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cfmkit.errors import UsageError

_ENTRY_PATTERN = re.compile(r"@\w+\{.*?\n\}", re.DOTALL)
_FIELD_PATTERN = re.compile(r"(\w+)\s*=\s*\{(.*?)\}\s*(?=,\s*\n|\n\s*\}$)", re.DOTALL)
_ACCENT_PATTERN = re.compile(r"\{?\\\W\{?(\w)\}*")  # an accent of LaTeX and its letter, which is shown without it
_NO_BRACES = str.maketrans("", "", "{}")


@dataclass(frozen=True)
class Paper:
    """One paper."""

    name: str  # family name of the first author, and year: ``lan-2010``
    reference: str  # in one line
    bibtex: str  # its entry


def read_papers(text: str) -> tuple[Paper, ...]:
    r"""Return the papers of a BibTeX file, in its order.

    Each field is in braces; fields are separated by a comma at the end of a line.

    Raises
    ------
    cfmkit.errors.UsageError
        If an entry has no author, title or year.

    Examples
    --------
    >>> text = "@article{X,\n author = {Lan, Chao-Chieh and Lee, Kok-Meng},\n title = {On},\n year = {2006}\n}"
    >>> [(paper.name, paper.reference) for paper in read_papers(text)]
    [('lan-2006', 'C.-C. Lan, K.-M. Lee, On, (2006)')]
    """
    return tuple(_read_paper(entry) for entry in _ENTRY_PATTERN.findall(text))


def _read_paper(entry: str) -> Paper:
    fields = {
        name.lower(): " ".join(_ACCENT_PATTERN.sub(r"\1", text).translate(_NO_BRACES).split())
        for name, text in _FIELD_PATTERN.findall(entry)
    }
    if missing := [name for name in ("author", "title", "year") if name not in fields]:
        raise UsageError(f"references.bib: {entry.partition(',')[0]} has no {' and no '.join(missing)}")
    authors = [author.partition(", ")[::2] for author in fields["author"].split(" and ")]
    names = [f"{_initials(first)} {family}" for family, first in authors]
    home = " ".join(filter(None, (fields.get("journal") or fields.get("booktitle"), fields.get("volume"))))
    place = " ".join(filter(None, (home, f"({fields['year']})", fields.get("pages", "").replace("--", "-"))))
    source = f"doi:{doi}" if (doi := fields.get("doi")) else ""
    reference = ", ".join(filter(None, (*names, fields["title"], place, fields.get("note"), source)))
    return Paper(f"{authors[0][0].lower()}-{fields['year']}", reference, entry)


def _initials(first_names: str) -> str:
    """Return the initials of first names: ``C.-C.`` of ``Chao-Chieh``."""
    return re.sub(r"(\w)\w*\.?", r"\1.", first_names)
