"""Manufactured parts of a design: which values err, what becomes of parts, and which share of them is good.

`uncertain_values`
    How a value errs, alone and with others; what a specification says of it.
`parts`
    `Parts`: a specification with its errors, stated or assumed of a process, from which parts are drawn.
`requirement_rows`
    What decides whether a part is good, as inequalities in its force and stress at a few poses.
`near_parts`
    Parts by linear estimate, with exact derivatives where they are known: their yield, and the test plan.
`drawn_parts`
    Parts drawn and analysed, as rows of one solution where the family has them; the yield of a design by them.
`redesign`, `allowed_tolerances`
    Values for which enough parts are good, and the tolerances for which they are.
`share`
    `Share`: a yield with its confidence intervals.
"""
