"""YAML of the package's own data files, which no user writes: without places, limits and hints."""

from __future__ import annotations

from typing import Any

import yaml


def read_plain(text: str) -> Any:
    """Return what a trusted YAML text holds."""
    return yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
