"""One module per verb; its name is the command's, with ``-`` for ``_``.

A verb module has

- a frozen dataclass whose fields are its arguments and options (see `cfmkit.cli.options`), or ``make_options()``, which
  returns one with more fields;
- ``run(options, terminal) -> Document``, which takes one: its docstring is the help text;
- ``HELP_POSITION``: where it stands in ``cfmkit --help``, and perhaps ``HELP_EXAMPLE``.

A module that is added here is a command; nothing else needs to know. Anything slow to
import is imported inside ``run``.
"""

from __future__ import annotations

import pkgutil


def names() -> list[str]:
    """Return the names of all verbs."""
    return [item.name.replace("_", "-") for item in pkgutil.iter_modules(__path__)]
