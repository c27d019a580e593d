"""The kit that optimised designs are made with, whatever the mechanism: it knows no family.

`objective_and_constraints`
    What a family sees at a point, an objective and limits by name, becomes a program of `cfmkit.numerics.sqp`; which
    limits the point misses, and which of them hold it.
`rounded_and_reported_values`
    Numbers within bounds: rounded to what is written, and those that are at a bound.
`run_many_starts`
    Many starts, in this process or several, each noted when it is finished, within a time budget.
`rounded_and_reported_values`
    What is reported of a design is what the analysis of its written specification measures.
`robust_design`
    Values for which made parts are good: margins from tolerances by linear estimate, and drawn parts.

What a design is to do, the start it begins with and the words for what blocks it belong to the family.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "robust_design": "RobustProblem with_margins",
        "run_many_starts": "UNLIMITED_CLOCK Clock",
    },
)
