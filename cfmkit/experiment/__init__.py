"""Measured curves: reading lab files, branches, filters, hysteresis, and what a model makes of them.

`reading` reads a file as it comes, `branches` splits it
at reversals, `filtering` smooths each branch, `measured` puts the numbers together.
"""
