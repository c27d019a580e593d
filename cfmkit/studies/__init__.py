"""Studies: many variants of one specification, each evaluated once, whether it can be solved or not.

A study sees a specification, dotted paths and names of metrics; it knows no family.

`leaves` and `variation` say what may vary and how, `plan` enumerates the points,
`study` evaluates one of them, `blocks` many at once where the model is vectorised,
`executors`, `pool` and `cluster` are ways to get that done, `journal` and `rows`
remember what is finished, `engine` puts these together, `noted_metrics` names what is
noted, `tables` writes it, `summary` sums it up, and `sweep` is the study that
varies a specification.
"""
