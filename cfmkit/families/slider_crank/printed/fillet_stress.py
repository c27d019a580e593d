"""The largest stress of a printed slider-crank in each of its fillets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.fillet_table import FilletRow, fillet_table
from cfmkit.families.slider_crank.printed.chain import FLEXURES
from cfmkit.stock.spec import PaddedPart

if TYPE_CHECKING:
    from cfmkit.arrays import FloatArray
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.solid.meshed_part import MeshSolution
    from cfmkit.tables import Table


def fillets(spec: SliderCrankSpec, pins: FloatArray, solved: MeshSolution, window: tuple[float, float]) -> Table:
    """Return the fillets of a leg with their largest stress in a window [m], named by pad or flexure.

    pins: places of the flexures, unloaded, (3, 2) [m].
    """
    from cfmkit.solid.fillet_stress import stressed_fillets

    pads = {place.name: place.shapes for place in solved.part.places}
    rows = []
    for one in stressed_fillets(solved, (spec.mechanism.part or PaddedPart()).fillet):
        nearest = FLEXURES[int(np.hypot(*(pins - one.arc.middle).T).argmin())]
        names = [] if spec.piece == "beam" else [nearest]
        names += one.arc.touched(pads) or ([] if names else ["strip"])
        if (found := one.largest(*window)) is not None:
            rows.append(FilletRow(": ".join(names), one.arc, *found))
    return fillet_table(rows)
