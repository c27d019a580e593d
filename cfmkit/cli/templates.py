"""The specs that `cfmkit new` starts from; they come with the package that has the family."""

from __future__ import annotations

from importlib.resources import files

from cfmkit.errors import UsageError
from cfmkit.families import family


def template(name: str) -> str:
    """Return the commented spec of a family.

    Raises
    ------
    cfmkit.errors.UsageError
        If there is no such family, or it comes without a template.
    """
    record = family(name)
    if not record.template:
        raise UsageError(f"the family {name!r} has no template; `cfmkit show {name}` lists its keys")
    package, _, path = record.template.partition("/")
    return files(package).joinpath(path).read_text(encoding="utf-8")
