"""Libraries that only some users need: imported when they are used, and named with the command that installs them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from cfmkit.errors import UsageError


def library(
    name: str,  # what it is imported as
    purpose: str,  # what needs it, for the message: ``to_pandas``
) -> Any:
    """Return an optional library.

    Raises UsageError where it is not installed, with the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError:
        raise UsageError(f"{purpose} needs {name}: pip install {name}") from None
