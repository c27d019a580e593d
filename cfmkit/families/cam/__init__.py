"""Cam mechanisms: rollers, cam and springs [Sanchez-Salinas et al. 2022]."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "mechanism_from_spec": "assemble",
        "spec": "CamSpec",
        "statics": "forces",
    },
)
