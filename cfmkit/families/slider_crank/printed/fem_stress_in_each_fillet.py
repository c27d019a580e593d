"""The largest stress of a printed slider-crank in each of its fillets.

Nominal stresses are those of the flexures between rigid links, or of the strip.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cfmkit.families.fem_results import FilletRow, with_nominal
from cfmkit.families.nominal_stress_beside_fillets import PATH_TOLERANCE, nominal_stresses, with_steps
from cfmkit.families.slider_crank.printed.flexures_as_beam_network import FLEXURE_BEAMS

if TYPE_CHECKING:
    from cfmkit.families.slider_crank.printed.equilibrium_path import Chain
    from cfmkit.families.slider_crank.spec import SliderCrankSpec
    from cfmkit.solid.meshed_part import MeshSolution


def fillets(
    spec: SliderCrankSpec, chain: Chain, solved: MeshSolution, window: tuple[float, float]
) -> tuple[FilletRow, ...]:
    """Return the fillets of a leg with their largest stress in a window [m], named by pad or flexure.

    chain: the leg as beams, unloaded.
    """
    from cfmkit.solid.stress_along_fillets import stressed_fillets

    pads = {place.name: place.shapes for place in solved.part.places}
    rows = []
    for one in stressed_fillets(solved, spec.mechanism.fillet):
        nearest = FLEXURE_BEAMS[int(np.hypot(*(chain.pins - one.arc.middle).T).argmin())]
        names = [] if spec.piece == "beam" else [nearest]
        names += one.arc.find_touched(pads) or ([] if names else ["strip"])
        if (found := one.largest(*window)) is not None:
            rows.append(FilletRow(": ".join(names), one.arc, *found))
    stresses = nominal_stresses(
        rows,
        np.array([row.motion for row in rows]),
        lambda travel: [chain.press(with_steps(travel), tolerance=PATH_TOLERANCE).path],
        lambda points: points,
    )
    return with_nominal(rows, stresses)
