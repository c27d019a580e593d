"""Completion in a shell of more than verbs, options and files: names of families, topics, and keys."""

from __future__ import annotations

from typing import Any

LARGEST_HEAD = 20_000
"""Characters of a file in which its family is looked for; a completion that reads more would be felt."""


def families(incomplete: str) -> list[str]:
    """Return the names of families that begin with the text typed so far."""
    from cfmkit.families import names

    return [name for name in names() if name.startswith(incomplete)]


def topics(incomplete: str) -> list[str]:
    """Return what `cfmkit show` explains and begins so: topics, families, and everything else that has a name."""
    from cfmkit.cli.show_topics import TOPIC_HEADINGS, names

    known = [*TOPIC_HEADINGS, *families("")]
    # names by the hundred only once somebody has begun one
    every = [*known, *names()] if incomplete else known
    return list(dict.fromkeys(name for name in every if name.startswith(incomplete)))


def changes(ctx: Any, incomplete: str) -> list[str]:
    """Return what ``--set`` may begin with: keys of the family of the specification that was named, or of all.

    Items of lists are completed with the number of the first.
    """
    from cfmkit import families
    from cfmkit.specs.keys_and_schema import keys

    path, equals, _ = incomplete.partition("=")
    records = [families.family(name) for name in _families_named(ctx)]
    known = {key.path.replace("[]", ".0"): key for record in records for key in keys(record.spec_type)}
    if equals:
        words = known[path].kind.split(" | ") if path in known and " | " in known[path].kind else []
        return [f"{path}={word}" for word in words if f"{path}={word}".startswith(incomplete)]
    found = [path for path in known if path.startswith(incomplete) and known[path].kind != "block"]
    # one level at a time would save no key press: names below a block are few
    return [f"{path}=" for path in found]


def _families_named(ctx: Any) -> list[str]:
    """Return the family of the specification on the command line; all of them where there is none to be read."""
    from cfmkit import families

    named = [ctx.params.get("spec"), *(ctx.params.get("specs") or ())]
    found = []
    for name in filter(None, named):
        try:
            with open(name, encoding="utf-8") as file:
                lines = file.read(LARGEST_HEAD).splitlines()
        except (OSError, UnicodeDecodeError):
            continue
        found += [line.partition(":")[2].split("#")[0].strip() for line in lines if line.startswith("family:")]
    known = families.names()
    return [name for name in found if name in known] or list(known)
