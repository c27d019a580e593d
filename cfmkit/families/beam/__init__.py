"""Mechanisms of slender beams in large deflection [Lan, Wang, Chen 2010]."""
