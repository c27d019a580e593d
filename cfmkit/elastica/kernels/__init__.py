"""Compiled code of the beam engine. Importing `cfmkit.elastica.kernels.compiled` loads compiled code: only to solve."""
