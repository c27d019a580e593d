"""Compiled code of the beam engine. Importing `cfmkit.elastica.kernels.entry` loads compiled code: only to solve."""
