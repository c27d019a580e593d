"""A small request for `suggest`, and what families offer for it."""

from __future__ import annotations

from typing import Any

from cfmkit import Run
from cfmkit.families import family
from cfmkit.runs import read_request

POM = {  # 10 N of POM over 3 mm
    "safety": "1",
    "force": "10 N",
    "travel": "3 mm",
    "ripple": "3 %",
    "envelope": "[80 mm, 60 mm, 12 mm]",
    "material": "pom",
}


def request(**keys: Any) -> Any:
    """Return the small request with other keys."""
    return read_request(None, POM | keys).request()


def propose(name: str, asked: Any) -> Any:
    """Return what a family offers for a request."""
    return family(name).propose(asked, Run())
