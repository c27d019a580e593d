"""Proposals of `cfmkit.suggest`, which show themselves in a notebook as the command line prints them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from cfmkit.studies.suggest.search import Suggestions

if TYPE_CHECKING:
    from cfmkit.studies.suggest.spec import SuggestBlock


@dataclass(frozen=True, repr=False)
class SuggestionsView(Suggestions):
    """Proposals with what was requested; a notebook shows their table and the mechanisms to one scale."""

    block: SuggestBlock | None = field(default=None, compare=False)  # always there; it follows fields with defaults

    @classmethod
    def answering(cls, suggestions: Suggestions, block: SuggestBlock) -> SuggestionsView:
        """Return suggestions with the block `suggest` that they answer."""
        return cls(**{item.name: getattr(suggestions, item.name) for item in fields(suggestions)}, block=block)

    def __repr__(self) -> str:
        """Return the proposals in a line: family and variant of the first ten."""
        from cfmkit.runs.suggestion_record import message

        listed = [f"{proposal.family} {proposal.variant}"[:100] for proposal in self.listed[:10]]
        return f"<Suggestions: {'; '.join([message(self), *listed])}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from cfmkit.documents.notebook import show_html
        from cfmkit.documents.suggestion_document import document_of
        from cfmkit.runs.suggestion_record import as_json, exit_code
        from cfmkit.studies.suggest.figures import to_one_scale

        assert self.block is not None  # `of`
        figures = {"proposals": lambda: to_one_scale(self.listed, self.request)} if self.listed else {}
        return show_html(document_of(as_json(self, self.block), exit_code(self)), figures)
