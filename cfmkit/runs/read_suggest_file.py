"""A request from its file, from options, or from both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.errors import SpecError
from cfmkit.runs.specfile import STDIN_PATH, content, rename_source, standard_input
from cfmkit.specs.yamlio import read_document
from cfmkit.studies.suggest.spec import SuggestFile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.studies.suggest.spec import SuggestBlock


def read_request(name: str | None, keys: Mapping[str, str]) -> SuggestBlock:
    """Return the request of a file, or of none, with keys replaced by what options say.

    Parameters
    ----------
    name : str, optional
        The file; ``-`` is standard input.
    keys : mapping of str to str
        Key of the request -> its value as a file would have it.

    Raises
    ------
    cfmkit.errors.SpecError
        With everything that is wrong with it.
    """
    if name is None:
        document = read_document("cfmkit: 1\nsuggest: {}\n", "options")
    else:
        document = read_document(standard_input() if name == STDIN_PATH else content(name), name)
    for key, value in keys.items():
        document = document.set(f"suggest.{key}={value}")
    try:
        return document.bind(SuggestFile).suggest
    except SpecError as error:
        reported = error
    for key in keys:
        reported = rename_source(reported, f"--set suggest.{key}", f"--{key}")
    raise reported
