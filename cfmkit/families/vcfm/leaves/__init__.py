"""The laws of leaves and of springs that are made of them, in closed form."""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "cosine": "CosineLeaf",
        "dimensions_and_material": "LeafStrip",
        "hybrid": "HybridLeaf",
        "positive_stiffness_springs": (
            "Diamond Folded StraightSpring TrussDiamond UShape force_change measured_stiffness_for rest_shift"
        ),
        "v_beam": (
            "FLAT_BUCKLED_ABOVE NEGATIVE_ABOVE TrussLeaf VBeam buckled_stress first_stiffness negative_stiffness "
            "onset_and_exit"
        ),
    },
)
