"""One module a verb; its name is the command's, with ``-`` for ``_``.

A verb module has

- ``Options``: a frozen dataclass whose annotated fields are the arguments and options;
- ``run(options, terminal) -> Answer``: its docstring is the help text;
- ``PLACE``: where it stands in ``cfmkit --help``.

A module that is added here is a command; nothing else needs to know. Anything slow to
import is imported inside ``run``.
"""
