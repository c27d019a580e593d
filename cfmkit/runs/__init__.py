"""A run over one specification or many: read and check it, compute, and write a folder of files."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "explorer": "Explorer",
        "explorer_server": "ExplorerServer",
        "suggest": "read_request",
    },
)
