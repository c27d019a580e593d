"""Mechanism families that other installed packages offer: found by entry points, listed without importing them.

A package adds a family by an entry point of the group ``cfmkit.families``, its name that of the family and its value
``module:record``. The entry points are read from the small files that installers write, since importing
`importlib.metadata` alone takes longer than listing may. As in `importlib.metadata`, the first one counts of a package
that is on the path twice. Packages in zip files are not found.

A family that is used is imported, which runs code of its package; if that fails, the error says why (`Unusable`).
"""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from collections.abc import Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, fields, is_dataclass
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NoReturn

from cfmkit.errors import StoppedBySignal, UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from cfmkit.families.base import Family

ENTRY_POINT_SECTION = "[cfmkit.families]"  # heading of the group in a file of entry points
_INFO_PATTERN = re.compile(r"(?P<package>[^-]+)(?:-(?P<version>[^-]+))?.*\.(?:dist|egg)-info")
"""Name of a folder in which an installer describes a package, with the package's name and version."""


class Unusable(UsageError):
    """A family of another package that cannot be used."""


@dataclass(frozen=True)
class InstalledFamily:
    """A family that an installed package offers."""

    name: str  # of the family
    target: str  # ``module:record``
    # package, version: what was installed
    package: str
    version: str

    @property
    def source(self) -> str:
        """The package and its version."""
        return f"{self.package} {self.version}".rstrip()


def offers() -> tuple[InstalledFamily, ...]:
    """Return what the packages on the path offer, in the order of the names."""
    return _offers_on(tuple(sys.path))


@lru_cache(maxsize=8)
def _offers_on(path: Sequence[str]) -> tuple[InstalledFamily, ...]:
    families: list[InstalledFamily] = []
    seen: set[str] = set()
    for folder in path:
        for info, package, version in _installed_in(folder or "."):
            if package not in seen:
                seen.add(package)
                families += (InstalledFamily(name, target, package, version) for name, target in _entries(info))
    return tuple(sorted(families, key=lambda family: (family.name, family.package)))


def _installed_in(folder: str) -> Iterator[tuple[str, str, str]]:
    """Yield (folder with its entry points, name, version) of each package that is installed in a folder."""
    try:
        names = sorted(os.listdir(folder))
    except OSError:  # not a folder: a zip file, or the hook of an editable install
        return
    for name in names:
        if name.endswith("-info") and (match := _INFO_PATTERN.fullmatch(name)):
            package = re.sub(r"[-_.]+", "-", match["package"]).lower()
            yield os.path.join(folder, name), package, match["version"] or ""


def _entries(info: str) -> Iterator[tuple[str, str]]:
    """Yield (name, target) of the entry points of the group."""
    try:
        with open(os.path.join(info, "entry_points.txt"), encoding="utf-8", errors="replace") as file:
            text = file.read()
    except OSError:
        return
    inside = False
    for line in map(str.strip, text.splitlines() if ENTRY_POINT_SECTION in text else ()):
        if line.startswith("["):
            inside = line == ENTRY_POINT_SECTION
        elif inside and "=" in line and not line.startswith(("#", ";")):
            name, _, target = line.partition("=")
            yield name.strip(), target.partition("[")[0].strip()


def usable_names(taken: Iterable[str]) -> tuple[str, ...]:
    """Return the names of families that one package offers and cfmkit has not taken; nothing is imported."""
    offer_names = [offer.name for offer in offers()]
    return tuple(name for name in offer_names if offer_names.count(name) == 1 and name not in set(taken))


def import_family(offer: InstalledFamily, taken: Iterable[str]) -> Family:
    """Import and return the family that a package offers, under a name that is not `taken`.

    Raises Unusable with the reason in one line, if it cannot be used.
    """
    record = _clash(offer, taken) or _import_record(offer)
    if isinstance(record, str):
        raise Unusable(f"the family {visible(offer.name)!r} of the package {offer.source} cannot be used: {record}")
    return record


def forget_installed() -> None:
    """Forget what packages offer: it is read anew, as after an installation while this process runs."""
    _import_record.cache_clear()
    _offers_on.cache_clear()


def _clash(offer: InstalledFamily, taken: Iterable[str]) -> str:
    """Return why a name is not free; empty if it is."""
    if offer.name in taken:
        return "cfmkit itself has a family of this name"
    others = [candidate.package for candidate in offers() if candidate.name == offer.name and candidate != offer]
    return f"{' and '.join(others)} offers one of this name, too; uninstall one of them" if others else ""


@lru_cache(maxsize=64)
def _import_record(offer: InstalledFamily) -> Family | str:
    """Return the record, or why there is none: whatever the package raises when it is imported or looked at."""
    try:
        with redirect_stdout(sys.stderr), _distinguish_ctrl_c():  # standard output is for results
            module, _, name = offer.target.partition(":")
            record = getattr(import_module(module), name)
            return _fault_of(record, offer) or record
    except _Interrupted:
        raise KeyboardInterrupt from None
    except StoppedBySignal:
        raise
    except BaseException as error:
        return f"it cannot be imported: {_sentence_of(error)}"


class _Interrupted(StoppedBySignal):
    """Ctrl-C in a program that leaves it to Python; a KeyboardInterrupt may also be raised by a package."""


@contextmanager
def _distinguish_ctrl_c() -> Iterator[None]:
    """Let Ctrl-C raise an exception that no package raises by itself."""
    usual = signal.getsignal(signal.SIGINT)
    if usual is not signal.default_int_handler or threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> NoReturn:
        raise _Interrupted

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)


def _sentence_of(error: BaseException) -> str:
    """Return what an exception of a package says, in one line; to say it may fail, too."""
    try:
        message = visible(" ".join(str(error).split()))
    except Exception:
        message = ""
    return f"{type(error).__name__}{': ' if message else ''}{message}"


def _fault_of(record: Any, offer: InstalledFamily) -> str:
    """Return why a record cannot be used; empty if it can."""
    from cfmkit.families.base import Family

    if not isinstance(record, Family):
        return f"{offer.target} is a {type(record).__name__}, not a Family"
    if record.name != offer.name:
        return f"its record is called {record.name!r}"
    return fault_of_record(record)


def fault_of_record(record: Family, needs_interface: bool = True) -> str:
    """Return why a record cannot be used; empty if it can. A record that is made now need not state its interface."""
    from cfmkit.families.base import INTERFACE_VERSION
    from cfmkit.metrics import definitions

    if record.interface is None and needs_interface:
        return f"its record does not state its interface; this cfmkit has 'interface={INTERFACE_VERSION}'"
    if record.interface not in (None, INTERFACE_VERSION):
        return (
            f"its record is for interface {record.interface}, this cfmkit has interface {INTERFACE_VERSION}; another "
            "version of one of them is needed"
        )
    if fault := _fault_of_fields(record, ""):
        return fault
    # the name of a metric of forces alone may be that of a value where torques drive
    metrics = {metric.name for metric in definitions("force")} & {metric.name for metric in definitions("torque")}
    if twice := [name for name in record.outputs.values if name.partition("[")[0] in metrics]:
        return f"its value {twice[0]!r} has the name of a metric: it needs another one"
    if record.folder and not _is_folder(record.folder):
        return f"the field 'folder' of its record names no folder of a package: {record.folder!r}"
    return "" if record.papers or not record.bibtex else "its references.bib has no entry that can be read"


def _fault_of_fields(record: Any, above: str) -> str:
    """Return which field of a record, or of a part of it, is not of its type; empty if none."""
    for entry in fields(record):
        value, name = getattr(record, entry.name), f"{above}{entry.name}"
        if not _is_of_kind(value, str(entry.type)):
            empty = ", and not empty" if isinstance(value, Mapping) and not value else ""
            return f"the field {name!r} of its record must be of the type {entry.type}{empty}"
        if is_dataclass(value) and not isinstance(value, type) and (fault := _fault_of_fields(value, f"{name}.")):
            return fault
    return ""


def _is_folder(name: str) -> bool:
    from importlib.resources import files

    package, _, path = name.partition("/")
    return files(package).joinpath(path).is_dir()


def _is_of_kind(value: Any, kind: str) -> bool:
    """Return whether a field of a record is what its annotation says, as far as every verb relies on it."""
    from cfmkit.families import base
    from cfmkit.specs.spec import Spec

    def are(parts: Any, *types: type) -> bool:
        return all(isinstance(part, types) for part in parts)

    if value is None:
        return kind.endswith("| None")
    kind = kind.removesuffix(" | None")
    if kind == "type[Spec]":
        return isinstance(value, type) and issubclass(value, Spec)
    if kind == "tuple[str, ...]":
        return isinstance(value, tuple) and are(value, str)
    if kind.startswith("Mapping"):
        if not isinstance(value, Mapping) or not are(value, str):
            return False
        if "Analyzer" in kind:
            return bool(value) and all(map(callable, value.values()))
        if "tuple" in kind:
            pairs = "..." not in kind
            return are(value.values(), tuple) and all(
                are(item, str) and (not pairs or len(item) == 2) for item in value.values()
            )
        return are(value.values(), str)
    if kind.startswith("Callable") or kind in ("Sampler", "Outliner"):
        return callable(value)
    return isinstance(value, {"str": str, "int": int}.get(kind) or getattr(base, kind))


def code_identity(offer: InstalledFamily) -> dict[str, str]:
    """Return the identity of the code of a family: its package, the version and the SHA-256 of its files."""
    from pathlib import Path

    from cfmkit.store.content_hashes_and_versions import file_hash, tree_hash

    try:
        module_spec = find_spec(offer.target.partition(":")[0].partition(".")[0])
    except (ImportError, ValueError):  # no name of a module: then nothing is computed by it either
        module_spec = None
    content = ""
    if module_spec is not None and module_spec.submodule_search_locations:
        content = "".join(tree_hash(Path(folder)) for folder in module_spec.submodule_search_locations)
    elif module_spec is not None and module_spec.origin:
        content = file_hash(Path(module_spec.origin).resolve()) or ""
    return {"package": offer.package, "version": offer.version, "content": content}
