"""The specs that `cfmkit new` starts from; they come with the package."""

from __future__ import annotations

from importlib.resources import files

from cfmkit.families import family


def template(name: str) -> str:
    """Return the commented spec of a family.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no such family.
    """
    record = family(name)
    return files("cfmkit").joinpath("templates", record.template).read_text(encoding="utf-8")
