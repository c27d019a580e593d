"""Cam and rollers: profile slope, roller path, cut flank, and tracks on it as designed and as built."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "flank_from_roller_path": "DesignFlank",
        "slope_law": "SlopeLaw",
    },
)
