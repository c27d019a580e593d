"""Tidy tables: named columns with units, and the one kind of CSV that cfmkit writes.

A table has one row per observation and one column per quantity. Numbers stand in the units of the border (mm, N, N*mm,
MPa, deg, kg, s, and ``1`` for ratios); columns without a unit hold names, states and counts. What is missing (None, NaN
or an empty text) is an empty cell.
"""

from cfmkit.tables.csv_and_json import csv_chunks, read_csv, to_csv
from cfmkit.tables.table import Cell, Table, TableColumn, Values, border_column, border_values, curve_table, text_column

__all__ = [
    "Cell",
    "Table",
    "TableColumn",
    "Values",
    "border_column",
    "border_values",
    "csv_chunks",
    "curve_table",
    "read_csv",
    "text_column",
    "to_csv",
]
