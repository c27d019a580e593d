"""A wish from its file, from options, or from both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cfmkit.runs.specfile import STDIN, content, standard_input
from cfmkit.specs.yamlio import read_document
from cfmkit.suggest.spec import WishFile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cfmkit.suggest.spec import WishBlock


def wish_of(name: str | None, keys: Mapping[str, str]) -> WishBlock:
    """Return the wish of a file, or of none, with keys replaced by what options say.

    Parameters
    ----------
    name : str, optional
        The file; ``-`` is standard input.
    keys : mapping of str to str
        Key of the wish -> its value as a file would have it.

    Raises
    ------
    cfmkit.errors.SpecError
        With everything that is wrong with it.
    """
    if name is None:
        document = read_document("cfmkit: 1\nwish: {}\n", "options")
    else:
        document = read_document(standard_input() if name == STDIN else content(name), name)
    for key, value in keys.items():
        document = document.set(f"wish.{key}={value}")
    return document.bind(WishFile).wish
