"""Rigid links with springs at their joints: torque at the crank, or force at the slider, in closed form.

[LH] B. Li, G. Hao, Chin. J. Mech. Eng. 32 (2019) 10.1186/s10033-019-0369-z.
[B] P. Bilancia, A. Geraci, G. Berselli, SMASIS2019-5519, sec. 2.1.
"""
