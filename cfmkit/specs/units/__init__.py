"""Units: the border between text such as ``0.69 N/mm`` and SI floats.

Inside cfmkit every number is SI (m, N, rad, Pa, kg, s). Text with units exists in
specifications, options, tables and messages only, and passes through here.

`strict_decimal_number` reads decimals strictly, `table` lists dimensions and units with their exact sizes, `quantities`
reads and writes text, `fields` holds the annotated types for specifications, `decimal_scaling_and_grids` moves decimal
points.
"""

from cfmkit.specs.units.fields import (
    SHARE_DIMENSION,
    Angle,
    BareFloat,
    Density,
    Displacement,
    Ends,
    Factor,
    Force,
    Inertia,
    Length,
    LineLoad,
    Mass,
    MetricValue,
    Place,
    Ratio,
    RotationalStiffness,
    Stiffness,
    Stress,
    Time,
    Torque,
    TravelShare,
    UnitField,
    attach_dimension,
    dimension_of_end,
    ends_increase,
    quantity,
    window_places,
)
from cfmkit.specs.units.quantities import (
    format_quantity,
    format_short,
    meant_as_percent,
    read_one_of,
    read_quantity,
)
from cfmkit.specs.units.strict_decimal_number import read_number
from cfmkit.specs.units.table import (
    DIMENSIONS_BY_NAME,
    border_unit,
    from_border,
    to_border,
    unit_table,
)

__all__ = [
    "DIMENSIONS_BY_NAME",
    "SHARE_DIMENSION",
    "Angle",
    "BareFloat",
    "Density",
    "Displacement",
    "Ends",
    "Factor",
    "Force",
    "Inertia",
    "Length",
    "LineLoad",
    "Mass",
    "MetricValue",
    "Place",
    "Ratio",
    "RotationalStiffness",
    "Stiffness",
    "Stress",
    "Time",
    "Torque",
    "TravelShare",
    "UnitField",
    "attach_dimension",
    "border_unit",
    "dimension_of_end",
    "ends_increase",
    "format_quantity",
    "format_short",
    "from_border",
    "meant_as_percent",
    "quantity",
    "read_number",
    "read_one_of",
    "read_quantity",
    "to_border",
    "unit_table",
    "window_places",
]
