"""Libraries that only some users need: imported when they are used, and named with the command that installs them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from cfmkit.errors import UsageError


def library(name: str, purpose: str) -> Any:
    """Return an optional library.

    Parameters
    ----------
    name : str
        What it is imported as.
    purpose : str
        What needs it, for the message: ``to_pandas``.

    Raises
    ------
    cfmkit.errors.UsageError
        Where it is not installed, with the command that installs it.
    """
    try:
        return import_module(name)
    except ImportError:
        raise UsageError(f"{purpose} needs {name}: pip install {name}") from None
