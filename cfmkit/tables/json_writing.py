"""JSON as cfmkit writes it to files."""

from __future__ import annotations

import json
from typing import Any


def json_bytes(data: Any) -> bytes:
    """Return JSON with two spaces, in the order given, UTF-8, a line feed at the end.

    Raises ValueError if there is a NaN or an infinity inside: no reader of JSON takes them.

    Examples
    --------
    >>> json_bytes({"value": None})
    b'{\\n  "value": null\\n}\\n'
    """
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode("utf-8", "backslashreplace")
