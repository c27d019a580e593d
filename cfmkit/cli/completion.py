"""What a shell may complete: names of families and topics, and files with specifications or data."""

from __future__ import annotations

import os


def families(incomplete: str) -> list[str]:
    """Return the names of families that begin so."""
    from cfmkit.families import names

    return [name for name in names() if name.startswith(incomplete)]


def topics(incomplete: str) -> list[str]:
    """Return what `cfmkit show` explains and begins so: topics, families, and everything else that has a name."""
    from cfmkit.cli.topics import TOPICS, names

    known = [*TOPICS, *families("")]
    # names by the hundred only once somebody has begun one
    every = [*known, *names()] if incomplete else known
    return list(dict.fromkeys(name for name in every if name.startswith(incomplete)))


def specs(incomplete: str) -> list[str]:
    """Return the YAML files, and the folders on the way to more, whose paths begin so."""
    return _files(incomplete, (".yaml", ".yml"))


def tables(incomplete: str) -> list[str]:
    """Return the CSV files, and the folders on the way to more, whose paths begin so."""
    return _files(incomplete, (".csv",))


def _files(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    folder, begun = os.path.split(incomplete)
    try:
        entries = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return []
    shown = [entry for entry in entries if entry.name.startswith(begun) and begun[:1] == entry.name[:1] == "."]
    shown = shown or [entry for entry in entries if entry.name.startswith(begun) and not entry.name.startswith(".")]
    wanted = [entry for entry in shown if entry.is_dir() or entry.name.lower().endswith(endings)]
    return [os.path.join(folder, entry.name) + ("/" if entry.is_dir() else "") for entry in wanted]
