"""Dependence of results on parameters: methods, and what becomes of samples that fail.

Sampling and analysing are apart: a method draws points, the engine evaluates them, the method reads the outcome. The
statistics work on plain arrays and know no mechanism. Distributions, made parts, shares of good ones and the tolerances
that keep a yield are those of `cfmkit.studies.parts`.

A method is a module of its name with a record `SENSITIVITY_METHOD` (`method`), listed in
`cfmkit.specs.sensitivity_methods`: `oat`, `local`, `morris`, `sobol`, `tolerance`, `inverse`. `setup` says what is to
be done, `run_and_files` joins method and engine, `result_types` holds what came out: of samples without a value an
index is not stated, never "no influence".
"""

from cfmkit.specs.sensitivity_methods import METHOD_NAMES

__all__ = ["METHOD_NAMES"]
