"""How results depend on parameters: six methods, and what becomes of samples that fail.

Sampling and analysing are apart: a method draws points, somebody evaluates them, the
method reads the outcome. The statistics work on plain arrays and know no mechanism:
`oat`, `local`, `morris`, `sobol`, `monte_carlo_yield` and `inverse`, with `distributions` (of the
parameters), `probability_confidence_intervals` (confidence) and `failed_sample_policy` (what a sample without a value
means for an index: never "no influence").

`parameters` reads the block `sensitivity:` against a specification, `setup` says what is to be done,
`run_sensitivity_method` joins method and engine, `result_types` and `output` say what came out.
"""
