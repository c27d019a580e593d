"""Pages of the documentation site that are made from the package; Sphinx is not needed for them."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[2] / "docs"


@cache
def load_site() -> Any:
    """Return the module that makes the pages."""
    sys.path.insert(0, str(DOCS))
    try:
        import made_pages
    finally:
        sys.path.remove(str(DOCS))
    return made_pages


@cache
def read_pages() -> dict[str, str]:
    """Return the pages by name."""
    pages: dict[str, str] = load_site().made()
    return pages
