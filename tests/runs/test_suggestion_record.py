"""Record and table of a search: what was not judged stands apart from what meets the request."""

from __future__ import annotations

from suggest_support import POM

import cfmkit
from cfmkit.runs.suggest import as_json, table


def test_what_was_not_judged_meets_nothing_and_says_what_is_missing(monkeypatch):
    """No life is known of the wire of these springs."""
    monkeypatch.setattr("cfmkit.studies.suggest.search.names", lambda: ("cam",))
    keys = POM | {"envelope": "[120 mm, 120 mm, 30 mm]", "cycles": 20000}
    found = cfmkit.suggest(**keys)
    assert found.exit_code == 6
    record = as_json(found, found.block)
    assert record["proposals"] == []
    assert record["status"] == "partial"
    assert record["message"] == found.message
    assert [one["unjudged"] for one in record["unjudged"]] == [list(one.open) for one in found.unjudged]
    assert "life not judged: no S-N data for the wire of its springs" in record["unjudged"][0]["unjudged"]
    rows = table(found).decode().splitlines()
    assert len(rows) == 1 + len(found.unjudged) + len(found.near_misses)
    assert ",open: " in rows[1]
