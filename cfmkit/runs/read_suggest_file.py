"""A request from its file, from options, or from both."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from cfmkit.errors import Problem, SpecError
from cfmkit.runs.specfile import STDIN_PATH, content, rename_source, standard_input
from cfmkit.specs.yamlio import read_document
from cfmkit.studies.suggest.spec import SuggestFile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.studies.suggest.spec import SuggestBlock

OPTIONS_SOURCE = "options"
"""Name of a request that has no file."""


def read_request(
    name: str | None,  # the file; ``-`` is standard input
    keys: Mapping[str, str],  # key of the request -> its value as a file would have it
    mark: str = "--",  # what stands before a key in messages; nothing where keys are arguments of a function
) -> SuggestBlock:
    """Return the request of a file, or of none, with keys replaced by what options say.

    Raises SpecError with everything that is wrong with it.
    """
    if name is None:
        document = read_document("cfmkit: 1\nsuggest: {}\n", OPTIONS_SOURCE)
    else:
        document = read_document(standard_input() if name == STDIN_PATH else content(name), name)
    for key, value in keys.items():
        document = document.set(f"suggest.{key}={value}")
    try:
        return document.bind(SuggestFile).suggest
    except SpecError as error:
        reported = error
    for key in keys:
        reported = rename_source(reported, f"--set suggest.{key}", f"{mark}{key}")
    raise reported if name is not None else _name_missing_options(reported, mark)


def _name_missing_options(error: SpecError, mark: str) -> SpecError:
    """Return the error of a request without a file with a missing key as a missing option."""
    return SpecError(
        [
            Problem("", 0, 0, "", re.sub(r"^the key '(\w+)' is missing.*", rf"{mark}\1 is missing", one.message))
            if one.source == OPTIONS_SOURCE
            else one
            for one in error.problems
        ]
    )
