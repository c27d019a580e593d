"""Networks that differ in places, shapes and sections alone: followed together by compiled code, each with its error.

One of them has been traced by itself. The others are followed with the lowest degree that serves that one, and with a
higher one through a few values of the drive: the difference is the error of each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.compiled_batch import CompiledBatch, is_compiled
from cfmkit.elastica.mechanics.designs import make_up, set_up
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.equations import MarchCode
from cfmkit.elastica.model.drive import Loading
from cfmkit.elastica.model.network import apart
from cfmkit.elastica.model.plain_beams_at_once import is_plain
from cfmkit.elastica.results.path import PathStatus
from cfmkit.elastica.tracing.error_estimate import (
    DEGREES_MORE,
    ERROR_SAFETY,
    NEXT_CORRECTION,
    ROUNDING_ERROR,
    pick_points,
)
from cfmkit.elastica.tracing.start import FREE_LENGTH_KEYS, next_correction
from cfmkit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.drive import Control
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.path import Path

LOWEST_DEGREE = 4
ERROR_MARGIN = 4.0  # tolerances over the error of the network that was traced, at the degree of all


def follow_alike(path: Path, networks: Sequence[Network], control: Control) -> FloatArray | None:
    """Return the efforts of networks that are like one that was traced, at all requested values of the drive.

    Parameters
    ----------
    path : Path
        Of the one.
    networks : sequence of Network
        The others.
    control : Control
        As the one was traced.

    Returns
    -------
    (d, k) array or None
        [N or N m]; not a number in rows of networks that must be traced by themselves: those of another topology, those
        that lose their stability, or miss the tolerance. None if the one has events, or bears anything at rest.
    """
    if not _goes_straight_on(path, control):
        return None
    efforts = np.full((len(networks), len(path.load_case.points)), np.nan)
    own = _get_common_values(path.network)
    alike = [k for k, network in enumerate(networks) if _get_common_values(network) == own]
    if alike:
        try:
            efforts[alike] = _follow(path, [networks[k] for k in alike], control)
        except InputError:  # one of them cannot exist
            return efforts
    return efforts


def _get_common_values(network: Network) -> Any:
    """Return what is the same in networks that are set up together; None if this one cannot be."""
    if network.contacts or not all(is_plain(beam) and beam.closure == "rotscale" for beam in network.beams.values()):
        return None
    supports = [node.support for node in network.nodes.values()]
    arms = [apart(network, link.node) for link in network.links]
    beams = [_get_beam_kind(beam) for beam in network.beams.values()]
    return make_up(network), supports, arms, beams, network.springs, network.loads


def _get_beam_kind(beam: Beam) -> Any:
    """Return whether a plain beam has offsets, stretches, and gets a floor of flexibility because it is straight."""
    shape: Any = beam.shape
    stretches = beam.section.axial
    return any(beam.start_offset), any(beam.end_offset), stretches, not stretches and not any(shape.coefficients[1:])


def _goes_straight_on(path: Path, control: Control) -> bool:
    """Return True if a network rests before its drive, is set up without cuts, and nothing happens on its path."""
    arrays = path.mesh
    springs = [spring.item for spring in arrays.springs]
    rests = not (
        path.network.loads
        or arrays.base.any()
        or any(getattr(s, name, None) for s in springs for name in FREE_LENGTH_KEYS)
    )
    quiet = path.status is PathStatus.COMPLETE and not path.events and not path.unstable.any()
    simple = _get_common_values(path.network) is not None and arrays.pieces == 1 and not arrays.tension
    alone = control.imperfection or isinstance(path.load_case, Loading) or np.any(arrays.floored)
    return bool(rests and quiet and simple and not alone and is_compiled(arrays))


def _follow(path: Path, networks: list[Network], control: Control) -> Any:
    """Return the efforts of networks that are like that of a path."""
    drive, points = path.load_case, path.load_case.points
    origin, pairs = (path.network, drive), [(network, drive) for network in networks]

    def set_up_at(degree: int, some: list[Any]) -> CompiledBatch:
        template = discretise(*origin, degree, scales=path.mesh.scales, fits=path.mesh.fits)
        return CompiledBatch(set_up(template, origin, some))

    def efforts_of(batch: CompiledBatch, chosen: Sequence[int] = ()) -> tuple[FloatArray, FloatArray]:
        correction, turn = next_correction(control), control.largest_turn
        efforts, codes, states = batch.march(points, tolerance=correction, largest_turn=turn, chosen=chosen)
        return np.where((codes == MarchCode.DONE)[:, None], efforts, np.nan), states

    highest = path.mesh.degree + DEGREES_MORE
    exact = efforts_of(set_up_at(highest, [origin]))[0][0]
    size = np.abs(exact).max()
    degrees = range(LOWEST_DEGREE, highest)
    errors = ((k, np.abs(efforts_of(set_up_at(k, [origin]))[0][0] - exact).max()) for k in degrees)
    degree = next((k for k, error in errors if ERROR_MARGIN * error <= control.tolerance * size), highest)
    few = np.sort(path.requested[pick_points(path, ())])
    efforts = np.full((len(pairs), len(points)), np.nan)
    left = np.arange(len(pairs))
    while left.size and degree <= highest:  # a degree for all, a higher one for those that miss the tolerance
        batch = set_up_at(degree, [pairs[k] for k in left])
        coarse, states = efforts_of(batch, few.tolist())
        finer = batch.compare(states, points[few], degree + DEGREES_MORE, NEXT_CORRECTION)
        change = np.abs(finer.effort * batch.effort_unit - coarse[:, few])
        change[~finer.converged | (finer.unstable != 0)] = np.nan
        error = ERROR_SAFETY * change.max(axis=1) + ROUNDING_ERROR * size
        accurate = error <= control.tolerance * np.abs(coarse).max(axis=1)
        efforts[left[accurate]] = coarse[accurate]
        left, degree = left[~accurate], degree + DEGREES_MORE
    return efforts
