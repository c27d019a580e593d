"""Rigid links with springs at their joints: torque at the crank, or force at the slider, in closed form.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "bistability_class": "scale_factors small_angle_number",
        "fit_nonnegative_rates": "RateGoal least_squares",
        "sprung_linkage": "assemble",
    },
)
