"""Compiled code of the beam engine. Importing `cfmkit.beams.kernels.entry` loads the compiler: do so only to solve."""
