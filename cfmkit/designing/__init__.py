"""Parts of every design by optimisation: problem as a program, many starts, margins for tolerances, rounded values.

`objective_and_constraints`: objective and limits of a family as a program of `cfmkit.numerics.sqp`; limits that are
missed or active. `run_many_starts`: starts in one process or several, each kept when it is finished, within a time
budget. `robust_design`: values for which manufactured parts are good. `rounded_and_reported_values`: of a finished
design.

Targets, first guesses and the words for what blocks a design belong to the family.
"""

from cfmkit.lazy_names import lazy_names

__getattr__, __all__ = lazy_names(
    __name__,
    {
        "robust_design": "RobustProblem with_margins",
        "run_many_starts": "UNLIMITED_CLOCK Clock",
    },
)
