"""Made parts of a design: what errs, what becomes of parts, and which share of them is good.

`uncertain_values`, `uncertain_values`
    How a value errs, alone and with others; what a specification says of it.
`parts`
    `Parts`: a specification with its errors, stated or assumed of a process, from which parts are drawn.
`requirement_rows`
    What decides whether a part is good, as rows of force and stress at a few poses.
`near_parts`
    `NearParts`: parts by linear estimate, with exact derivatives where they are known; their yield.
`near_parts`
    The test plan: what to measure of a part, and what force to expect of it.
`drawn_parts`
    `Outcomes`: parts drawn and analysed, as rows of one solution where the family has them.
`drawn_parts`
    The yield of a design by such parts, before and after its design, without common errors and after a trim.
`redesign`, `allowed_tolerances`
    Values for which enough parts are good, and the tolerances for which they are.
`share`
    `Share`: a yield with its confidence intervals.
"""
