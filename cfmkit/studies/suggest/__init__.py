"""Mechanisms for a request: each family proposes candidates, all are analysed, those that meet it are shown."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "proposal_making_and_judging": "Proposal ProposalJob make_proposal",
    },
)
