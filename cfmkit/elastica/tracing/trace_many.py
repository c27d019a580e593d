"""Many networks under one drive: in this process or over several, one outcome each, failures kept as such.

Networks that differ in places, shapes and sections alone are followed together by compiled code, as rows of models. One
of them is traced by itself. The others are followed with the lowest degree that serves that one, and with a higher one
through a few values of the drive: the difference is the error of each.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

import numpy as np

from cfmkit.elastica.mechanics.compiled import CompiledEquations, angle_laws, compare_rows, pack_plan
from cfmkit.elastica.mechanics.compiled_module import ADDRESS_FIELDS, COUNT_FIELDS, load_compiled, slope_products
from cfmkit.elastica.mechanics.designs import make_up, set_up
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.equations import ComparedStates, MarchCode, MarchPlan
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.mechanics.polynomials import basis
from cfmkit.elastica.mechanics.problem import DEGREES_MORE
from cfmkit.elastica.model.beam_fits import is_plain
from cfmkit.elastica.model.drive import Control, Loading
from cfmkit.elastica.model.network import apart
from cfmkit.elastica.results.path import PathStatus
from cfmkit.elastica.tracing.accuracy import (
    ERROR_SAFETY,
    NEXT_CORRECTION,
    ROUNDING_ERROR,
    pick_points,
)
from cfmkit.elastica.tracing.start import is_tight, next_correction
from cfmkit.elastica.tracing.trace import FIRST_STEP, trace
from cfmkit.errors import CfmError, InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from concurrent.futures import Future

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica.mechanics.designs import NetworkDesigns
    from cfmkit.elastica.model.beam import Beam
    from cfmkit.elastica.model.drive import Drive
    from cfmkit.elastica.model.network import Network
    from cfmkit.elastica.results.path import Path


class CompiledBatch:
    """Real designs that were set up together, without constant loads or displaced supports, as rows of models."""

    def __init__(self, designs: NetworkDesigns) -> None:
        """Make the rows: the template's, with addresses of arrays that differ from design to design."""
        template: Any = equations(designs.template)
        mesh, tables = designs.template, designs.tables
        self.mesh, self.count, self.effort_unit = mesh, designs.count, template.effort_unit
        rule, bending = basis(mesh.degree), tables["weight"] * tables["rigidity"]
        bend = (bending[..., 0] / rule.weights[0])[..., None] * (rule.weights @ slope_products(mesh.degree))
        arrays = tables | designs.places | {"bend": bend}  # what is the same along an element, but for the weights
        self.laws = angle_laws(designs.fits[0].bundle.coefficients, mesh)
        self._kept = {name: np.ascontiguousarray(array, float) for name, array in arrays.items()}
        self.rows = np.tile(template.row, (self.count, 1))
        for name, array in self._kept.items():
            addresses = array.ctypes.data + array.strides[0] * np.arange(self.count)
            self.rows[:, len(COUNT_FIELDS) + ADDRESS_FIELDS.index(name)] = addresses

    def march(
        self,
        targets: FloatArray,  # (k,) values of the drive [m or rad]
        tolerance: float = 1e-9,  # of corrections, relative to the largest motion and force
        largest_turn: float = MarchPlan.largest_turn,  # change of a motion in one step [rad, or lengths of a beam]
        chosen: Sequence[int] = (),  # targets at which the states are wanted, too
    ) -> tuple[FloatArray, Any, FloatArray]:
        """Return efforts (d, k) [N or N m], `MarchCode` (d,) and states (d, chosen, size) of designs from rest on.

        Efforts are not a number from where a path under a drive by a motion does not simply go on.
        """
        mesh, goals = self.mesh, np.ascontiguousarray(targets, float) / self.mesh.scales.drive
        span = max(float(goals.max()), 0.0) - min(float(goals.min()), 0.0)
        plan = MarchPlan(FIRST_STEP * span, span, largest_turn=largest_turn, tolerance=tolerance)
        efforts, codes = np.full((self.count, len(goals)), np.nan), np.zeros(self.count, np.int64)
        free, some = np.full((self.count, len(chosen), len(mesh.free)), np.nan), np.array(chosen, np.int64)
        plan_row = pack_plan(plan, 0, True)
        if not load_compiled().march_many(self.rows, plan_row, goals, efforts, codes, some, free, plan.room):
            raise MemoryError
        states = np.tile(goals[some, None] * mesh.rate, (self.count, 1, 1))
        states[..., mesh.free] = free
        return efforts * self.effort_unit, codes, states

    def compare(self, states: FloatArray, drives: FloatArray, degree: int, tolerance: float) -> ComparedStates:
        """Return how states (d, k, size) at some drives (k,) [m or rad] differ from equilibria of a higher degree."""
        ways = drives / self.mesh.scales.drive
        return compare_rows(self.rows, self.mesh, self.laws, states, ways, degree, tolerance)


LOWEST_DEGREE = 4
ERROR_MARGIN = 4.0  # tolerances over the error of the network that was traced, at the degree of all


def follow_alike(path: Path, networks: Sequence[Network], control: Control) -> FloatArray | None:
    """Return the efforts of networks that are like one that was traced, at all requested values of the drive, (d, k).

    [N or N m]; not a number in rows of networks that must be traced by themselves: those of another topology, those
    that lose their stability, or miss the tolerance. None if the one has events, or bears anything at rest.
    """
    if not _goes_straight_on(path, control):
        return None
    efforts = np.full((len(networks), len(path.load_case.points)), np.nan)
    common = _get_common_values(path.network)
    alike = [k for k, network in enumerate(networks) if _get_common_values(network) == common]
    if alike:
        try:
            efforts[alike] = _follow_together(path, [networks[k] for k in alike], control)
        except InputError:  # one of them cannot exist
            return efforts
    return efforts


def _get_common_values(network: Network) -> Any:
    """Return the values that networks which are set up together share; None if this one cannot be."""
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
    rests = not (path.network.loads or arrays.base.any() or any(map(is_tight, springs)))
    quiet = path.status is PathStatus.COMPLETE and not path.events and not path.unstable.any()
    simple = _get_common_values(path.network) is not None and arrays.pieces == 1 and not arrays.tension
    alone = control.imperfection or isinstance(path.load_case, Loading) or np.any(arrays.floored)
    system = equations(arrays)
    compiled = (
        isinstance(system, CompiledEquations) and not system.follows
    )  # those with contacts have arrays of their own
    return bool(rests and quiet and simple and not alone and compiled and not arrays.contacts)


def _follow_together(path: Path, networks: list[Network], control: Control) -> Any:
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


_CHUNK_SIZE, _CHUNKS_PER_PROCESS = 256, 2  # networks set up at once; chunks for each process that are on their way


@dataclass(frozen=True)
class NetworkOutcome:
    """Status and collected value of one network."""

    # status, message: name and sentence of the path's status; ``INVALID`` and the reason where the network cannot exist
    status: str
    message: str
    value: Any  # what was collected from the path; None if there is no path


@dataclass(frozen=True)
class Requested:
    """Drive, effort and stability at the requested points that were reached."""

    drive: FloatArray
    effort: FloatArray
    stable: Any


def collect_requested(path: Path) -> Requested:
    """Return a path's values at the requested points: the default of what `trace_many` collects."""
    keep = path.at_requested
    return Requested(path.drive[keep], path.effort[keep], path.stable[keep])


def trace_many(
    networks: Iterable[Network | Callable[[], Network]],
    drive: Drive,
    control: Control | None = None,
    collect: Callable[[Path], Any] = collect_requested,
    workers: int = 1,
) -> Iterator[NetworkOutcome]:
    """Yield one outcome for each network, in their order; nothing but the collected values is kept.

    Networks of one topology are followed together where nothing happens on their way (`follow_alike`): their efforts
    have the tolerance of `trace`, not its last digits.

    Parameters
    ----------
    networks : iterable of Network, or of functions that return one
        Taken some at a time: however many there are, few are kept. Functions
        (a `functools.partial` of what builds the network, importable for several workers) are called where the network
        is traced, which leaves less to do for the process that gives out the work.
    drive : Displacement, Rotation or Loading
        What is done to each.
    control : Control, optional
        As in `trace`.
    collect : callable
        From a path to what is wanted of it; must be importable for several workers.
    workers : int
        Processes to use.
    """
    trace_chunk = partial(_yield_outcomes, drive=drive, control=control or Control(), collect=collect)
    source = iter(networks)
    chunks = iter(lambda: list(islice(source, _CHUNK_SIZE)), [])
    if workers <= 1:
        yield from chain.from_iterable(map(trace_chunk, chunks))
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        waiting: deque[Future[list[NetworkOutcome]]] = deque()
        for chunk in chunks:
            waiting.append(pool.submit(_list_outcomes, trace_chunk, chunk))
            if len(waiting) > _CHUNKS_PER_PROCESS * workers:
                yield from waiting.popleft().result()
        while waiting:
            yield from waiting.popleft().result()


def _list_outcomes(trace_chunk: Callable[[list[Any]], Iterator[NetworkOutcome]], chunk: list[Any]) -> Any:
    return list(trace_chunk(chunk))


def _yield_outcomes(
    networks: list[Network | Callable[[], Network]], drive: Drive, control: Control, collect: Callable[[Path], Any]
) -> Iterator[NetworkOutcome]:
    """Yield the outcomes of some networks: of those that are followed together, or each by itself."""
    built = [_build(network) for network in networks]
    together: dict[int, FloatArray] | None = None
    for number, network in enumerate(built):
        if isinstance(network, NetworkOutcome):
            yield network
        elif together is not None and number in together:
            efforts = together[number]
            value = Requested(drive.points, efforts, np.ones(len(efforts), np.bool_))
            yield NetworkOutcome(PathStatus.COMPLETE.name, PathStatus.COMPLETE.value, value)
        else:
            try:
                path = trace(network, drive, control)
            except CfmError as error:
                yield NetworkOutcome("INVALID", str(error), None)
                continue
            if together is None and collect is collect_requested:
                together = _follow_rest(path, built, number, control)
            yield NetworkOutcome(path.status.name, path.message, collect(path))


def _build(network: Network | Callable[[], Network]) -> Network | NetworkOutcome:
    try:
        return network() if callable(network) else network
    except CfmError as error:
        return NetworkOutcome("INVALID", str(error), None)


def _follow_rest(
    path: Path, built: list[Network | NetworkOutcome], number: int, control: Control
) -> dict[int, FloatArray] | None:
    """Return the efforts of the networks behind one that was traced, by their numbers; None if they are not like it."""
    rest = {k: network for k, network in enumerate(built) if k > number and not isinstance(network, NetworkOutcome)}
    efforts = follow_alike(path, list(rest.values()), control)
    if efforts is None:
        return None
    return {k: row for k, row in zip(rest, efforts, strict=True) if np.isfinite(row).all()}
