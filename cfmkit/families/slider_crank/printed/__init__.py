"""From springs to a part that can be printed: small flexures at the joints, or one strip of varying thickness.

Both are planar beam networks: what the springs of the rigid-link model stand for, bent exactly, with its stresses.

[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.2 and 3.
[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z, sec. 7.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "equilibrium_path": "Chain PressingEnd",
        "flexure_sizing": "rotations",
        "flexures_as_beam_network": (
            "FLEXURE_BEAMS STRIP_BEAM Elasticity Flexure Strip flexure_ends flexure_network joints stations"
        ),
    },
)
