"""Exact model of a vcfm: leaves and spring as traced beams in large deflection; its analysis, its networks for exports.

One half-beam is traced and counted `half_beams` times; a shuttle that can turn needs both leaves of a V. Of the spring
one leaf or one chain is traced, by symmetry. How that is interpolated, `interpolated_equilibrium_path` says.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cfmkit.families.findings import mm
from cfmkit.families.vcfm.curves_in_rows import Characteristics, LeafSamples, PartSampler
from cfmkit.families.vcfm.interpolated_equilibrium_path import COEFFICIENT_RTOL, trace_leaf
from cfmkit.families.vcfm.leaf_laws_from_spec import leaf_law, leaf_spring, parts
from cfmkit.families.vcfm.leaves.positive_stiffness_springs import Coils
from cfmkit.families.vcfm.model import farthest_back, result_of, solve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cfmkit.arrays import FloatArray
    from cfmkit.elastica import Network
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork
    from cfmkit.families.run_control import Run
    from cfmkit.families.vcfm.interpolated_equilibrium_path import TracedPath
    from cfmkit.families.vcfm.leaves.dimensions_and_material import LeafStrip
    from cfmkit.families.vcfm.leaves.kinds import SpringChain
    from cfmkit.families.vcfm.leaves_spec import Bistable
    from cfmkit.families.vcfm.spec import VcfmSpec
    from cfmkit.results import Result
    from cfmkit.stock.material_and_part_spec import MaterialSpec

DOWN_ANGLE = -0.5 * np.pi


def section(strip: LeafStrip, thickness: Any = None, wide: bool = False) -> Any:
    """Return the engine's section of a leaf; `wide`: its curling across the width is hindered."""
    from cfmkit.elastica import Section

    return Section(
        strip.youngs_modulus,
        strip.width,
        strip.thickness if thickness is None else thickness,
        shear=True,
        poisson_ratio=strip.poisson_ratio,
        wide=wide,
    )


def leaf_network(spec: VcfmSpec) -> Network:
    """Return one leaf between wall and shuttle, or both leaves of a V whose shuttle can turn."""
    parts = spec.mechanism
    return _network_of(parts.bistable, parts.material, parts.wide_beams)


def _network_of(about: Bistable, made_of: MaterialSpec, wide: bool) -> Network:
    from cfmkit.elastica import CLAMPED_SUPPORT, Beam, Network, Node, Taper, slider_support

    law = leaf_law(about, made_of)
    strip = law.strip
    x, h = strip.reach, strip.rise
    nodes = {
        "wall": Node(0, 0, CLAMPED_SUPPORT),
        "shuttle": Node(x, h, slider_support(0.5 * np.pi, rotates=not about.guided)),
    }
    shape, mirrored = law.beam_shapes()
    shares, thicknesses = law.profile
    made = section(strip, Taper(np.array(shares), np.array(thicknesses)) if len(set(thicknesses)) > 1 else None, wide)
    beams = {"leaf": Beam("wall", "shuttle", made, shape)}
    if not about.guided:
        nodes["far wall"] = Node(2.0 * x, 0, CLAMPED_SUPPORT)
        beams["mirrored leaf"] = Beam("far wall", "shuttle", made, mirrored)
    return Network(nodes, beams)


MAX_KEPT_PATHS = 128
"""Paths of leaves, some 50 kB each: a catalogue needs one leaf with many springs, `suggest` one in many envelopes."""


@lru_cache(maxsize=MAX_KEPT_PATHS)
def _leaf_path(about: Bistable, made_of: MaterialSpec, wide: bool, end: float, branch: str | None) -> TracedPath:
    """Return what a leaf does up to `end` [m]; a branch is followed, and its waviness counts, where one is stated."""
    control = {} if branch is None else {"branch": branch, "imperfection": about.waviness}
    return trace_leaf(_network_of(about, made_of, wide), "shuttle", end, **control)


def spring_chain(spec: VcfmSpec) -> SpringChain:
    """Return what is traced of the spring."""
    law = leaf_spring(spec.mechanism.flexures, spec.mechanism.material)
    return law.chain(section(law.strip, wide=spec.mechanism.wide_beams))


def elastic_networks(spec: VcfmSpec) -> tuple[DrivenNetwork, ...]:
    """Return leaf and, unless it is bought, spring as beams with their travels, for decks of other solvers."""
    from cfmkit.elastica import Displacement
    from cfmkit.export.beam_deck_for_abaqus import DrivenNetwork

    networks = [
        DrivenNetwork("vcfm-leaf", leaf_network(spec), Displacement("shuttle", DOWN_ANGLE, np.array([spec.travel])))
    ]
    if spec.mechanism.springs is None:
        chain = spring_chain(spec)
        end = chain.travel * (max(*spec.analysis.preloads, 0.0) + spec.travel)
        drive = Displacement(chain.node, DOWN_ANGLE, np.array([end]))
        networks.append(DrivenNetwork("vcfm-spring", chain.network, drive))
    return tuple(networks)


class ExactSampler(PartSampler):
    """Samples of a mechanism's leaves and spring, traced over what an analysis needs.

    `end`: how far the shuttle goes [m]; `back`: how far it is pulled back at most, positive [m].
    """

    # pushed, pulled: of a leaf: of beams, or of a solid (`plane_fem_analysis.SolidPath`), which answers the same
    # questions
    pushed: Any
    pulled: Any
    sides: list[Any]  # of the spring, pushed and pulled
    is_traced = True
    accuracy = COEFFICIENT_RTOL
    coils: Coils | None
    """The law of bought springs, which have no path; None if the spring is a structure of leaves."""

    def __init__(self, spec: VcfmSpec, end: float, back: float) -> None:
        """Trace leaf and spring."""
        about, preloads = spec.mechanism.bistable, spec.analysis.preloads
        leaf, back = (about, spec.mechanism.material, spec.mechanism.wide_beams), max(back, 0.02 * end)
        self.each = about.half_beams * (1.0 if about.guided else 0.5)
        self.pushed = _leaf_path(*leaf, end, spec.analysis.branch)
        self.pulled = _leaf_path(*leaf, -back, None)
        self.coils = None if spec.mechanism.springs is None else Coils.from_springs(spec.mechanism.springs)
        self.problem = problem_of("bistable", (self.pushed, self.pulled), 1.0)
        if self.coils is not None:
            return
        self.chain = spring_chain(spec)
        ends = (max(max(preloads) + end, 0.02 * end), min(min(preloads) - back, -0.02 * end))
        self.sides = [trace_leaf(self.chain.network, self.chain.node, self.chain.travel * side) for side in ends]
        self.problem = self.problem or problem_of("positive", self.sides, self.chain.travel)

    def leaves(self, travel: FloatArray) -> LeafSamples:
        """Return what all leaves do at some travels [m]; NaN beyond what was reached."""
        place = np.ravel(travel)
        ahead, behind = self.pushed.evaluate(np.maximum(place, 0.0)), self.pulled.evaluate(np.minimum(place, 0.0))
        force, stress, stable, buckled = (
            np.where(place < 0, backward, forward).reshape(np.shape(travel))
            for backward, forward in zip(behind, ahead, strict=True)
        )
        return LeafSamples(self.each * force, stress, stable, buckled)

    def spring(self, compression: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return force [N] and largest stress [Pa] of the spring at some compressions [m]."""
        if self.coils is not None:
            return self.coils.force(compression), self.coils.stress(compression)
        place = self.chain.travel * np.ravel(compression)
        pressed, stretched = (
            self.sides[0].evaluate(np.maximum(place, 0.0)),
            self.sides[1].evaluate(np.minimum(place, 0.0)),
        )
        force, stress = (np.where(place < 0, stretched[k], pressed[k]).reshape(np.shape(compression)) for k in (0, 1))
        return self.chain.count * force, stress

    @cached_property
    def character(self) -> Characteristics:
        """Stiffnesses and linear range as traced."""
        push = self.pushed
        if not push.edges[-1]:
            return Characteristics(np.nan, 0.0, np.nan, (np.nan, np.nan))
        first, last = push.buckled_range
        places = np.linspace(first + 0.1 * (last - first), last - 0.1 * (last - first), 41)
        if np.isfinite(first):
            steepest = -float(np.polyfit(places, push.evaluate(places)[0], 1)[0])
        else:
            places = np.linspace(0.0, push.edges[-1], 801)
            steepest = max(0.0, -float(np.gradient(push.evaluate(places)[0], places).min()))
        tiny = 1e-4 * push.edges[-1]
        first_stiffness = float(
            (push.evaluate(np.array([tiny]))[0] - self.pulled.evaluate(np.array([-tiny]))[0])[0] / (2.0 * tiny)
        )
        if self.coils is None:
            forces = self.spring(np.array([-tiny, tiny]))[0]
            stiffness = float((forces[1] - forces[0]) / (2.0 * tiny))
        else:
            stiffness = self.coils.stiffness
        return Characteristics(stiffness, self.each * steepest, self.each * first_stiffness, (first, last))


def problem_of(part: Literal["bistable", "positive"], paths: Sequence[Any], travel: float) -> str:
    """Return how far a part was followed, in shares `travel` of its node, and why no farther; empty if to the end."""
    short = next((path for path in paths if path.problem), None)
    if short is None:
        return ""
    subject = {"bistable": "leaves were", "positive": "spring was"}[part]
    keys = ", ".join(f"'mechanism.{part}.{size}'" for size in ("length", "angle", "thickness"))
    return f"the {subject} followed only to {mm(short.edges[-1] / travel)}: {short.problem}; check {keys}"


def analyze(spec: VcfmSpec, _run: Run) -> Result:
    """Return the curves of a mechanism of beams in large deflection, with everything that is wrong with it.

    As `cfmkit.families.vcfm.model.analyze`; PARTIAL if a beam cannot be followed to the end of the travel.
    """
    made = parts(spec)
    # the real shuttle goes back as far as that of the closed form within a few percent
    back = 1.2 * farthest_back(spec, spec.analysis.preloads)
    return result_of(solve(spec, made, ExactSampler(spec, spec.travel, back)))
