"""``cfmkit doctor``: versions, packages, folders, locks, fonts and engine of this installation, and its faults."""

from __future__ import annotations

import os
import platform
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cfmkit._version import __version__
from cfmkit.cli.options import Common
from cfmkit.documents.document import Document, Field, Span, TextLine, Tone, Verbatim, field, record_table
from cfmkit.store.lock import SOFT_LOCK

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Block

    Record = dict[str, Any]

HELP_POSITION = 86


@dataclass(frozen=True, kw_only=True)
class DoctorOptions(Common):
    """Arguments and options."""


def run(options: DoctorOptions, terminal: Terminal) -> Document:
    """Report versions, packages, folders, compiled code and families, and any problems with them.

    Families of other packages are imported for this, which runs installed code.
    """
    report = {
        "versions": {"cfmkit": __version__, "python": platform.python_version(), "system": platform.platform()},
        "packages": list(_package_records()),
        "folders": [
            {"name": what, "path": str(path), "writable": _writable(path)} for what, path in _folders_to_check().items()
        ],
        "locks": _lock_record(),
        "solver": _solver_record(),
        "fonts": _font_record(),
        "caches": list(_cache_records()),
        "families": list(_family_records()),
    }
    troubles = tuple(_trouble_lines(report))
    data = {"message": "; ".join(troubles) or "nothing is wrong", **report}
    warnings = [{"name": "doctor", "message": trouble} for trouble in troubles]

    return Document({**data, "warnings": warnings}, _page_blocks(report, troubles))


def _package_records() -> Iterator[Record]:
    """Yield what cfmkit uses, with the version that is there, None if it is missing, and the versions allowed."""
    from importlib.metadata import PackageNotFoundError, requires, version

    from packaging.requirements import Requirement

    try:
        needed = requires("cfmkit") or []
    except PackageNotFoundError:  # run from its source, not installed
        needed = []
    for text in needed:
        extra = re.search(r"extra == ['\"]([^'\"]+)", text)
        if extra and extra[1] not in _USER_EXTRAS:
            continue
        package = Requirement(text)
        try:
            installed: str | None = version(package.name)
        except PackageNotFoundError:
            installed = None
        allowed = installed is None or package.specifier.contains(installed, prereleases=True)
        needs = {"needs": str(package.specifier), "allowed": allowed}
        yield {"name": package.name, "version": installed, "extra": extra[1] if extra else "", **needs}


_USER_EXTRAS = ("cluster",)
"""Optional parts that a user may want; those for tests and development are no matter of an installation."""


def _folders_to_check() -> Mapping[str, Path]:
    return {"output (the current folder)": Path.cwd(), "temporary files": Path(tempfile.gettempdir())}


def _writable(path: Path) -> bool:
    """Return whether a folder, or the nearest one above it that is there, can be written to."""
    while not path.exists() and path != path.parent:
        path = path.parent
    return path.is_dir() and os.access(path, os.W_OK | os.X_OK)


def _lock_record() -> Record:
    """Return whether the current folder has file locks; None if it cannot be written to."""
    from cfmkit.store.lock import has_native_locks

    folder = Path.cwd()
    try:
        return {"folder": str(folder), "native": has_native_locks(folder)}
    except OSError:
        return {"folder": str(folder), "native": None}


def _solver_record() -> Record:
    """Return what the beam engine runs on: "C" or "numpy"."""
    from cfmkit.elastica.mechanics.compiled_module import WITHOUT_C_VARIABLE
    from cfmkit.elastica.mechanics.march import engine

    return {"engine": engine(), "switched_off": WITHOUT_C_VARIABLE in os.environ}


def _font_record() -> Record:
    """Return the font of all figures and where it is: it comes with matplotlib, and another one changes their bytes."""
    from cfmkit.plots.font_cache import font_of_figures

    name, path = font_of_figures()
    return {"name": name, "path": path}


def _cache_records() -> Iterator[Record]:
    """Yield what cfmkit and its libraries keep between runs: everything there can be deleted and is made again."""
    from cfmkit.plots.font_cache import kept_lists

    for what, path in {"list of fonts": kept_lists()}.items():
        files = [file for file in Path(path).glob("*") if file.is_file()] if os.path.isdir(path) else []
        size = sum(file.stat().st_size for file in files)
        yield {"name": what, "path": str(path), "files": len(files), "megabytes": round(size / 1e6, 2)}


def _family_records() -> Iterator[Record]:
    """Yield every family that is offered, with what is wrong with it."""
    from cfmkit import families

    for offer, outcome in families.examine_families():
        package, version = ("cfmkit", __version__) if offer is None else (offer.package, offer.version)
        about = {"package": package, "version": version}
        if isinstance(outcome, str):
            yield {"name": offer.name if offer else "", **about, "state": "skipped", "reason": outcome}
        else:
            yield {"name": outcome.name, **about, "state": "ok", "reason": ""}


def _trouble_lines(report: Mapping[str, Any]) -> Iterator[str]:
    for record in report["packages"]:
        if record["version"] is None and not record["extra"]:
            yield f"the package {record['name']} is missing: install cfmkit again"
        if not record["allowed"]:
            needed = f"{record['name']}{record['needs']}"
            yield f"{record['name']} {record['version']} does not work with this cfmkit: pip install '{needed}'"
    for record in report["folders"]:
        if not record["writable"]:
            yield f"{record['path']} cannot be written to: {record['name']}"
    if report["locks"]["native"] is False:
        yield f"no file locks in {report['locks']['folder']}: {SOFT_LOCK} marks a live run, and stays if one is killed"
    if not report["fonts"]["path"]:
        yield f"the font {report['fonts']['name']} is not installed: figures use another one and are not byte-identical"
    for record in report["families"]:
        if record["reason"]:
            yield record["reason"]


def _page_blocks(report: Mapping[str, Any], troubles: Sequence[str]) -> Iterator[Block]:
    yield TextLine((Span("cfmkit doctor", Tone.LABEL), Span("  what this installation has")))
    versions = [{"name": name, "version": version} for name, version in report["versions"].items()]
    yield from record_table("versions", versions, (field("name"), field("version", wraps=True)))
    yield from record_table("packages", report["packages"], (field("name"), Field("version", _version_or_missing)))
    access = Field("", lambda folder: "writable" if folder["writable"] else "cannot be written to")
    yield from record_table("folders", report["folders"], (field("name"), access, field("path", wraps=True)))
    locks = {True: "by the operating system", False: f"none: the file {SOFT_LOCK} marks a live run", None: "not tried"}
    yield from record_table(
        "file locks here", [{"locks": locks[report["locks"]["native"]]}], (field("locks", wraps=True),)
    )
    yield from record_table(
        "beam engine", [{"engine": _describe_engine(report["solver"])}], (field("engine", wraps=True),)
    )
    fonts = {"name": report["fonts"]["name"], "path": report["fonts"]["path"] or "not found: matplotlib is incomplete"}
    yield from record_table("font of the figures", [fonts], (field("name"), field("path", wraps=True)))
    size = Field("size", lambda folder: f"{folder['files']} files, {folder['megabytes']} MB")
    yield from record_table(
        "caches (may be deleted)", report["caches"], (field("name"), size, field("path", wraps=True))
    )
    state = Field("state", lambda family: family["reason"] or family["state"], wraps=True)
    yield from record_table("families", report["families"], (field("name"), field("package"), field("version"), state))
    reported = [f"warning  {trouble}" for trouble in troubles] or ["nothing is wrong"]
    yield Verbatim("\n".join(["", *reported, ""]))


def _describe_engine(solver: Mapping[str, Any]) -> str:
    if solver["engine"] == "C":
        return "runs on compiled C"
    installed = "it was installed without a C compiler, or for another version"
    why = "CFMKIT_WITHOUT_C is set" if solver["switched_off"] else installed
    return f"runs on numpy, 25 to 100 times slower: {why}"


def _version_or_missing(package: Mapping[str, Any]) -> str:
    wanted = f"not installed; only for the extra {package['extra']}" if package["extra"] else "missing"
    return str(package["version"] or wanted)
