"""Slider-crank mechanisms with springs at their joints [Li, Hao 2019; Bilancia et al. 2019]."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "linkage": "Linkage",
        "unit_springs": "curves_along_crank curves_along_slider",
    },
)
