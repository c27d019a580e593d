"""Registry of mechanism families: lists them, imports one when it is first named, and says why one cannot be used.

A family is one of cfmkit, of another installed package (an entry point), or added to this process with `register`;
`cfmkit.metric` adds metrics. What an author of a family needs is imported here when it is first used.
"""

from __future__ import annotations

import secrets
from dataclasses import replace
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, get_args

from cfmkit.errors import UsageError, visible
from cfmkit.families import entry_point_plugins
from cfmkit.families.entry_point_plugins import Unusable, forget_installed
from cfmkit.lazy_names import lazy_names
from cfmkit.specs import further_metrics

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.families.base import DesignMethod, ElasticParts, Family, Pictures, ResultNames
    from cfmkit.families.findings import CannotBuild, Finder, Infeasible
    from cfmkit.families.hardware import PIN_STRENGTH, PartStrength
    from cfmkit.families.proposals import Candidate, FamilyOffer, Request
    from cfmkit.families.rows import FindingRule, ScalarQuantity, SolvedRows, Variants

FAMILY_MODULES = {
    "beam": "cfmkit.families.beam.record",
    "cam": "cfmkit.families.cam.record",
    "slider-crank": "cfmkit.families.slider_crank.record",
    "vcfm": "cfmkit.families.vcfm.record",
}
"""Those of this package, and the module with the record of each."""
_REGISTERED_FAMILIES: dict[str, Family] = {}
_REGISTRATION_STAMPS: dict[str, str] = {}
_WITH_OWN_METRICS: dict[str, tuple[str, Family, Family]] = {}


def register(record: Family) -> Family:
    """Add a family to those of this process, in place of one that was registered under its name; return it.

    Parameters
    ----------
    record : Family
        Its name is what ``family:`` of a specification says.

    Raises
    ------
    cfmkit.errors.UsageError
        If it is no such record, a field is of another type, or cfmkit or an installed package has the name.
    """
    from cfmkit.families.base import Family

    if not isinstance(record, Family):
        raise UsageError(f"a cfmkit.families.base.Family is needed, not {type(record).__name__}")
    fault = entry_point_plugins.fault_of_record(record, needs_interface=False) or _explain_bad_name(record)
    if record.name in FAMILY_MODULES:
        fault = "cfmkit itself has a family of this name"
    elif record.name in {offer.name for offer in entry_point_plugins.offers()}:
        fault = "an installed package has a family of this name"
    if fault:
        raise UsageError(f"the family {visible(str(record.name))!r} cannot be registered: {fault}")
    _REGISTERED_FAMILIES[record.name] = record
    _REGISTRATION_STAMPS[record.name] = secrets.token_hex(16)
    return record


def _explain_bad_name(record: Family) -> str:
    """Return why specifications of a family cannot name it; empty if they can."""
    allowed = get_args(record.spec_type.model_fields["family"].annotation)
    if not allowed or record.name in allowed:
        return ""
    return f"'family' of its specifications is {' or '.join(map(repr, allowed))}"


def list_registered() -> Mapping[str, Family]:
    """Return the families that were added to this process, by name."""
    return _REGISTERED_FAMILIES


def names() -> tuple[str, ...]:
    """Return the names of all families, those of other packages last; nothing is imported for it."""
    return (
        *FAMILY_MODULES,
        *_REGISTERED_FAMILIES,
        *entry_point_plugins.usable_names((*FAMILY_MODULES, *_REGISTERED_FAMILIES)),
    )


def clashing() -> tuple[str, ...]:
    """Return the names that more than one other package offers: none of those families can be used."""
    family_names = names()
    return tuple(dict.fromkeys(offer.name for offer in entry_point_plugins.offers() if offer.name not in family_names))


def family(name: str) -> Family:
    """Return the family called `name`, with the metrics of the user among its values.

    Raises
    ------
    cfmkit.families.Unusable
        If another package has it, but it cannot be used; the message says why.
    cfmkit.errors.UsageError
        If there is none; the message names the nearest. Or if a metric of the user has the name of another one.
    """
    record = _find_family(name)
    return record if not further_metrics.own_metrics() else _with_own_metrics(record)


def _with_own_metrics(record: Family) -> Family:
    """Return a family whose values have the metrics of the user; the same record until one of them changes."""
    stamp, plain, extended = _WITH_OWN_METRICS.get(record.name, ("", None, record))
    if stamp != further_metrics.stamp() or plain is not record:
        from cfmkit.metrics import known_metrics

        taken = {*record.outputs.values, *(item.name for item in known_metrics(None))}
        metrics = further_metrics.own_metrics()
        if clash := [name for name in metrics if name in taken]:
            raise UsageError(f"the metric {clash[0]!r} needs another name: {record.phrase} has one of this name")
        about = {name: (metric.dimension, metric.definition) for name, metric in metrics.items()}
        extended = replace(record, outputs=replace(record.outputs, values={**record.outputs.values, **about}))
        _WITH_OWN_METRICS[record.name] = further_metrics.stamp(), record, extended
    return extended


def _find_family(name: str) -> Family:
    if name in FAMILY_MODULES:
        record: Family = import_module(FAMILY_MODULES[name]).FAMILY_RECORD
        return record
    if name in _REGISTERED_FAMILIES:
        return _REGISTERED_FAMILIES[name]
    for offer in entry_point_plugins.offers():
        if offer.name == name:
            return entry_point_plugins.import_family(offer, FAMILY_MODULES)
    close = get_close_matches(name, names(), n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    raise UsageError(f"unknown family {name!r}; known are {', '.join(names())}{hint}")


def examine_families() -> tuple[tuple[entry_point_plugins.InstalledFamily | None, Family | str], ...]:
    """Return every family with the offer of the package it is from, or the reason why it cannot be used.

    Returns
    -------
    tuple of (InstalledFamily or None, Family or str)
        Those of this package and of this process come first, without an offer. All others are imported.
    """
    loaded = tuple((None, family(name)) for name in (*FAMILY_MODULES, *_REGISTERED_FAMILIES))
    return loaded + tuple((offer, _import_or_explain(offer)) for offer in entry_point_plugins.offers())


def records() -> tuple[Family, ...]:
    """Return all families that can be used, in the order of `names`; `list_skipped` says which cannot."""
    return tuple(examined for _, examined in examine_families() if not isinstance(examined, str))


def list_skipped() -> tuple[str, ...]:
    """Return one line for each family of another package that cannot be used, with the reason."""
    return tuple(examined for _, examined in examine_families() if isinstance(examined, str))


def _import_or_explain(offer: entry_point_plugins.InstalledFamily) -> Family | str:
    try:
        return entry_point_plugins.import_family(offer, FAMILY_MODULES)
    except Unusable as problem:
        return str(problem)


def origin(name: str) -> dict[str, str]:
    """Return what computes a family of another package, and metrics of the user; empty for cfmkit alone.

    Returns
    -------
    dict
        ``package``, ``version`` and ``content``, the SHA-256 of its files: what is kept for a later run is of these.
        ``registered`` where functions of this process compute: those of no other process are the same.
    """
    stamps = [*filter(None, (_REGISTRATION_STAMPS.get(name), further_metrics.stamp()))]
    return _identity_of_package(name) | ({"registered": " ".join(stamps)} if stamps else {})


def _identity_of_package(name: str) -> dict[str, str]:
    if name in FAMILY_MODULES or name in _REGISTERED_FAMILIES:
        return {}
    offers = entry_point_plugins.offers()
    return next((entry_point_plugins.code_identity(offer) for offer in offers if offer.name == name), {})


def origins() -> dict[str, dict[str, str]]:
    """Return what computes each family of another package or of this process, and metrics of the user."""
    computed = {
        offer.name: origin(offer.name) for offer in entry_point_plugins.offers() if offer.name not in FAMILY_MODULES
    }
    computed |= {name: origin(name) for name in _REGISTERED_FAMILIES}
    return computed | ({"metrics": {"registered": further_metrics.stamp()}} if further_metrics.stamp() else {})


__getattr__, _OFFERED_NAMES = lazy_names(
    __name__,
    {
        "base": "DesignMethod ElasticParts Family Pictures ResultNames",
        "findings": "Finder CannotBuild Infeasible",
        "hardware": "PIN_STRENGTH PartStrength",
        "rows": "FindingRule ScalarQuantity SolvedRows Variants",
        "proposals": "Candidate FamilyOffer Request",
    },
)

__all__ = [
    "FAMILY_MODULES",
    "Unusable",
    "clashing",
    "examine_families",
    "family",
    "forget_installed",
    "list_registered",
    "list_skipped",
    "names",
    "origin",
    "origins",
    "records",
    "register",
    *_OFFERED_NAMES,
]
