"""Mechanisms for a request: each family proposes candidates, all are analysed, those that meet it are shown."""

from importlib import import_module
from typing import Any

_NAMES_BY_MODULE = {
    "proposal_making_and_judging": "Proposal ProposalJob make_proposal",
    "spec": "SuggestBlock",
}
_MODULE_BY_NAME = {name: f"{__name__}.{module}" for module, names in _NAMES_BY_MODULE.items() for name in names.split()}
__all__ = [*_MODULE_BY_NAME]


def __getattr__(name: str) -> Any:
    """Import a name when it is first needed."""
    if name not in _MODULE_BY_NAME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_BY_NAME[name]), name)
