"""Findings of studies: command -> name -> meaning."""

STUDY_FINDINGS = {
    "sensitivity": {
        "failed_samples": "samples have no result: indices that need them are not stated; as parts they are bad",
        "not_stated": "indices or tolerances that cannot be stated are empty",
        "no_value": "a metric has no value for the specification itself and is left out",
        "correlation_not_used": "correlated deviations are stated for a method that varies every parameter by itself",
        "unbalanced": "the number of samples is not a power of two, at which Sobol sequences are balanced",
        "no_requirements": "without requirements there is no yield",
        "derived_part": "other values follow a varied parameter: every sample is a part made for its own value",
    },
    "--compare-fidelity": {"fidelity_left_out": "a model cannot run on this specification and is left out"},
    "suggest": {"search_cut_short": "the time budget ended the search before everything was tried"},
}
