"""Slider-crank mechanisms with springs at their joints [Li, Hao 2019; Bilancia et al. 2019]."""
