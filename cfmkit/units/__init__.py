"""Units: the border between text such as ``0.69 N/mm`` and SI floats.

Inside cfmkit every number is SI (m, N, rad, Pa, kg, s). Text with units exists in
specifications, options, tables and messages only, and passes through here.

`numbers` reads decimals strictly, `table` lists dimensions and units, `registry`
knows the exact size of a unit (pint, loaded on first use), `quantities` reads and
writes text, `fields` holds the annotated types for specifications.
"""

from cfmkit.units.fields import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularVelocity,
    Area,
    Bare,
    BareFloat,
    BareInt,
    Curvature,
    Damping,
    Density,
    Displacement,
    Energy,
    Factor,
    FlexuralRigidity,
    Force,
    Frequency,
    Inertia,
    Length,
    LineLoad,
    Mass,
    MetricValue,
    Place,
    Quantity,
    Ratio,
    RotationalDamping,
    RotationalStiffness,
    SecondMoment,
    Stiffness,
    Stress,
    Time,
    Torque,
    Velocity,
    Volume,
    quantity,
)
from cfmkit.units.numbers import read_number
from cfmkit.units.quantities import decimal_text, format_quantity, read_one_of, read_quantity
from cfmkit.units.registry import unit_table
from cfmkit.units.short import format_short
from cfmkit.units.table import DIMENSIONS, UNITS, Dimension, border_factor, border_unit, from_border, to_border

__all__ = [
    "DIMENSIONS",
    "UNITS",
    "Acceleration",
    "Angle",
    "AngularAcceleration",
    "AngularVelocity",
    "Area",
    "Bare",
    "BareFloat",
    "BareInt",
    "Curvature",
    "Damping",
    "Density",
    "Dimension",
    "Displacement",
    "Energy",
    "Factor",
    "FlexuralRigidity",
    "Force",
    "Frequency",
    "Inertia",
    "Length",
    "LineLoad",
    "Mass",
    "MetricValue",
    "Place",
    "Quantity",
    "Ratio",
    "RotationalDamping",
    "RotationalStiffness",
    "SecondMoment",
    "Stiffness",
    "Stress",
    "Time",
    "Torque",
    "Velocity",
    "Volume",
    "border_factor",
    "border_unit",
    "decimal_text",
    "format_quantity",
    "format_short",
    "from_border",
    "quantity",
    "read_number",
    "read_one_of",
    "read_quantity",
    "to_border",
    "unit_table",
]
