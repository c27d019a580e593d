"""What a specification of beams may say, and how nonsense is refused: file, line, key and a remedy."""

from __future__ import annotations

import re

import pytest
from beam_support import CANTILEVER, CONFIGS, cantilever, config

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.families import family
from cfmkit.families.beam.network_from_spec import resolve
from cfmkit.specs import keys
from cfmkit.studies import leaf, paths


def faults(*pairs, text=CANTILEVER):
    with pytest.raises(SpecError) as error:
        cantilever(*pairs, text=text)
    return [(problem.line, problem.path, problem.message) for problem in error.value.problems]


def only(*pairs, text=CANTILEVER):
    (found,) = faults(*pairs, text=text)
    return found


SLIDE = (
    "beams:\n    beam: {start: root, end: tip}\n"
    "  springs: {s: {kind: slide, node: to, direction: 0 deg, stiffness: 1 N/mm}}"
)
LOOSE = "beams:\n    beam: {start: root, end: tip}\n  springs: {s: {kind: line, start: tip, stiffness: 1 N/mm}}"
KNOT = LOOSE.replace("start: tip", "start: tip, ground: [400 mm, 0 mm]")
FORMULA = "points: 21\n  surface: {profile: {kind: formula, height: x+, length: 1 mm}, preload: 0 mm}"
FILE = "points: 21\n  surface: {profile: {kind: file, file: no.csv}, preload: 0 mm}"
RESCALE = "design: {rescale: {force: 1 N, free: width, width: 2 mm}}\nanalysis:"
OTHER = "design: {rescale: {to_allowable_stress: true, material: {youngs_modulus: 1 GPa}}}\nanalysis:"
MORE = "beams:\n    beam: {start: root, end: tip}"


@pytest.mark.parametrize(
    ("old", "new", "path", "words"),
    [
        ("end: tip", "end: top", "mechanism.beams.beam.end", "there is no node 'top'; nodes are root, tip"),
        ("end: tip", "end: root", "mechanism.beams.beam.end", "a beam needs two different nodes, not 'root' twice"),
        ("[400 mm, 0 mm]", "[0 mm, 0 mm]", "mechanism.beams.beam.end", "at the same place"),
        ("end: tip}", "end: tip, end_offset: [-400 mm, 1e-14 m]}", "mechanism.beams.beam.end", "at the same place"),
        (MORE, KNOT, "mechanism.springs.s.ground", "begins and ends at the place of 'tip': it has no direction"),
        ("node: tip", "node: root", "mechanism.drive.node", "'root' cannot move: its support is 'clamped'"),
        ("node: tip", "node: tipp", "mechanism.drive.node", "there is no node 'tipp'"),
        ("travel: 100 mm", "force: 1 N", "analysis.force", "does not go with a drive of kind 'displacement'"),
        ("travel: 100 mm", "travel: 10 deg", "analysis.travel", "must be a length"),
        ("travel: 100 mm", "travel: 0 mm", "analysis.travel", "must not be 0"),
        ("support: clamped}", "support: guided}", "mechanism.nodes.root", "needs 'direction'"),
        ("support: clamped}", "support: clampd}", "mechanism.nodes.root.support", "did you mean 'clamped'?"),
        ("end: tip}", "end: tip, shape: {kind: arch}}", "mechanism.beams.beam.shape.kind", "did you mean 'arc'?"),
        ("end: tip}", "end: tip, shape: {kind: arc}}", "mechanism.beams.beam.shape", "the key 'sweep' is missing"),
        ("end: tip}", "end: tip, shape: {kind: arc, sweep: 1}}", "mechanism.beams.beam.shape.sweep", "has no unit"),
        ("thickness: 1 mm", "thickness: [[0, 1 mm], [0.5, 1 mm]]", "mechanism.thickness", "from 0 to 1"),
        ("thickness: 1 mm", f"thickness: [[0, 1 mm]{3 * ', [0.5, 1 mm]'}, [1, 1 mm]]", "mechanism.thickness", "a step"),
        ("thickness: 1 mm", "thickness: [[0, 1 mm], [1, 1 mm], [1, 2 mm]]", "mechanism.thickness", "at an end"),
        ("end: tip}", "end: tip, shape: {kind: arc, sweep: 720 deg}}", "mechanism.beams.beam.shape.sweep", "turns"),
        (
            "end: tip}",
            "end: tip, shape: {kind: polynomial, coefficients: [9 deg, -360 deg]}}",
            "mechanism.beams.beam.shape.coefficients",
            "returns to its start",
        ),
        ("thickness: 1 mm", "thickness: 1 mm\n  shear: true", "mechanism.shear", "add 'axial: true'"),
        ("thickness: 1 mm", "thickness: -1 mm", "mechanism.thickness", "must be > 0"),
        ("youngs_modulus: 2.4 GPa", "youngs_modulus: 0 GPa", "mechanism.material.youngs_modulus", "must be > 0"),
        ("{youngs_modulus: 2.4 GPa, yield_strength: 50 MPa}", "pon", "mechanism.material", "did you mean 'pom'"),
        (MORE, f"{MORE}\n    b.2: {{start: root, end: tip}}", 'mechanism.beams.\'b.2\'', "a name is a letter"),
        ("support: clamped}", "support: clamped}\n    far: {at: [9 mm, 9 mm]}", "mechanism.nodes.far", "no beam"),
        (
            MORE,
            f"{MORE}\n  links: [{{master: tip, node: root}}]",
            "mechanism.links.0.node",
            "'root' has a support and cannot follow",
        ),
        (MORE, SLIDE, "mechanism.springs.s.node", "there is no node 'to'"),
        (MORE, LOOSE, "mechanism.springs.s", "give either 'end'"),
        (MORE, f"{MORE}\n  loads: [{{kind: line, beam: bam}}]", "mechanism.loads.0.beam", "there is no beam 'bam'"),
        (MORE, f"{MORE}\n  copies: {{layers: 2}}", "mechanism.copies.layers", "of a node that is 'guided'"),
        ("points: 21", FORMULA, "analysis.surface.profile.height", "is not a formula"),
        ("points: 21", FILE, "analysis.surface.profile.file", "there is no file 'no.csv'"),
        ("analysis:", RESCALE, "design.rescale", "'width' is given"),
        ("analysis:", OTHER, "design.rescale.to_allowable_stress", "without a strength"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_at_its_place(old, new, path, words):
    line, where, message = only((old, new))
    assert where == path
    assert words in message
    assert line > 0


def test_all_faults_are_told_at_once():
    found = faults(("start: root, end: tip", "start: foot, end: top"), ("node: tip", "node: end"))
    assert [path for _, path, _ in found] == [
        "mechanism.beams.beam.start",
        "mechanism.beams.beam.end",
        "mechanism.drive.node",
    ]


def test_links_may_not_run_in_a_circle():
    nodes = (
        "tip: {at: [400 mm, 0 mm]}",
        "tip: {at: [400 mm, 0 mm]}\n    a: {at: [1 mm, 0 mm]}\n    b: {at: [2 mm, 0 mm]}",
    )
    links = (MORE, f"{MORE}\n  links: [{{master: a, node: b}}, {{master: b, node: a}}]")
    assert only(nodes, links)[1:] == ("mechanism.links.1", "the links through 'a' form a loop")


def test_a_node_that_slides_is_driven_along_its_way():
    slides = ("tip: {at: [400 mm, 0 mm]}", "tip: {at: [400 mm, 0 mm], support: guided, direction: 60 deg}")
    path, sentence = only(slides)[1:]
    assert path == "mechanism.drive.direction"
    assert "'tip' slides along 60 deg only" in sentence
    assert "make both directions equal" in sentence


def test_what_no_support_holds_cannot_be_moved_beforehand():
    moved = ("support: clamped", "support: pinned, moved: {rotation: 1 deg}")
    assert "leaves that free" in only(moved)[2]


def test_rescaling_needs_a_mechanism_of_beams_alone():
    text = (CONFIGS / "beam_lan2010.yaml").read_text()
    spring = ("  drive:", "  loads: [{kind: point, node: n3, fy: 1 N}]\n  drive:")
    design = ("analysis:", "design: {rescale: {force: 15 N}}\nanalysis:")
    assert "Eq. 6 is about beams alone" in only(spring, design, text=text)[2]


def test_everything_that_forbids_rescaling_is_told_in_one_line():
    text = (CONFIGS / "beam_lan2010.yaml").read_text()
    pairs = (
        ("  drive:", "  loads: [{kind: point, node: n3, fy: 1 N}]\n  drive:"),
        ("b1: {start: n1, end: n3,", "b1: {start: n1, end: n3, material: pom,"),
        ("analysis:", "design: {rescale: {force: 15 N}}\nanalysis:"),
    )
    message = only(*pairs, text=text)[2]
    assert "springs, loads" in message
    assert "one material" in message


def test_a_beam_that_names_the_material_of_the_mechanism_is_of_one_material():
    text = (CONFIGS / "beam_lan2010.yaml").read_text()
    material = text[text.index("{youngs_modulus") : text.index("}", text.index("{youngs_modulus")) + 1]
    text = text.replace(material, "pom-lan-2010").replace("b1: {", "b1: {material: pom-lan-2010, ")
    spec = cantilever(("analysis:", "design: {rescale: {force: 15 N}}\nanalysis:"), text=text)
    assert spec.mechanism.beams["b1"].material == spec.mechanism.material
    assert spec.mechanism.beams["b2"].material is None


def test_switches_choose_the_model_and_the_stress():
    assert (cantilever().fidelity, cantilever().stress) == ("inextensible", "bending")
    axial = cantilever(("width: 100 mm", "width: 100 mm\n  axial: true"))
    assert (axial.fidelity, axial.stress) == ("extensible", "total")
    both = cantilever(("width: 100 mm", "width: 100 mm\n  axial: true\n  shear: true"))
    assert both.fidelity == "reissner"
    assert both.replace({"analysis.fidelity": "inextensible"}).fidelity == "inextensible"


@pytest.mark.parametrize(
    ("fidelity", "switches"),
    [
        ("inextensible", (False, False)),
        ("extensible", (True, False)),
        ("reissner", (True, True)),
        ("solid", (True, True)),
    ],
)
def test_a_model_is_written_out_as_its_switches(fidelity, switches):
    mechanism = resolve(cantilever(("analysis:", f"analysis:\n  fidelity: {fidelity}"))).mechanism
    assert (mechanism.axial, mechanism.shear) == switches


def test_values_below_names_are_found_by_their_path():
    spec = config("beam_lan2010")
    assert spec.get_value("mechanism.nodes.n3.at.1") == pytest.approx(0.01877)
    assert spec.get_value("mechanism.beams.b1.shape.coefficients.2") == -1.5707
    changed = spec.replace({"mechanism.nodes.n3.at.1": "19 mm"})
    assert changed.get_value("mechanism.nodes.n3.at.1") == pytest.approx(0.019)
    assert changed.get_value("mechanism.nodes.n4.at") == spec.get_value("mechanism.nodes.n4.at")


def test_paths_below_names_can_be_varied_and_are_listed():
    kind = type(config("beam_lan2010"))
    assert leaf(kind, "mechanism.nodes.n3.at.1").kind == "quantity"
    assert leaf(kind, "mechanism.beams.b1.shape.length").kind == "quantity"
    assert "mechanism.nodes.NAME.at.0" in set(paths(kind))
    listed = {key.path for key in keys(family("beam").spec_type)}
    assert {"mechanism.nodes.NAME.at", "mechanism.beams.NAME.shape.sweep", "mechanism.links[].master"} <= listed


def test_a_written_specification_reads_back_equal():
    for name in ("beam_lan2010", "beam_end_effector", "beam_rescaled"):
        spec = config(name)
        assert cfmkit.loads(cfmkit.dumps(spec)) == spec


LONG = "1" * 401


@pytest.mark.parametrize(
    ("shape", "key", "words"),
    [
        ("{kind: polynomial, coefficients: [0 deg, 1e12 deg]}", "coefficients.1", "at most 10000 turns of 360 deg"),
        ("{kind: polynomial, coefficients: [0 deg, 3e6 deg]}", "coefficients", "at most 1000 are supported"),
        ("{kind: polynomial, coefficients: [" + "1 deg, " * 10_000 + "1 deg]}", "coefficients", "at most 10000 may be"),
        ("{kind: arc, sweep: 1e12 deg}", "sweep", "at most 10000 turns of 360 deg"),
        ("{kind: arc, sweep: -3e6 deg}", "sweep", "must be >= -360000 deg and <= 360000 deg"),
        ("{kind: arc, sweep: " + LONG + " deg}", "sweep", "is too long"),
    ],
)
def test_shapes_that_wind_beyond_what_can_be_sampled_are_refused_with_the_limit(shape, key, words):
    _, path, message = only(("end: tip}", f"end: tip, shape: {shape}}}"))
    assert path == f"mechanism.beams.beam.shape.{key}"
    assert words in message


def test_a_beam_may_wind_and_have_many_coefficients_within_the_limits():
    for coefficients in ("0 deg, 359000 deg", ", ".join(["0 deg"] + ["175 deg"] * 1_999)):
        pair = ("end: tip}", f"end: tip, shape: {{kind: polynomial, coefficients: [{coefficients}]}}}}")
        assert cantilever(pair).mechanism.beams["beam"].shape.kind == "polynomial"


@pytest.mark.parametrize(
    ("height", "words"),
    [
        ("1/0", "has no height at x = 0 mm"),
        ("1/(x - 6)", "has no height at x = 6 mm"),
        ("sqrt(5 - x)", "has no height at x = 5.04 mm"),
        ("exp(x**4)", "has no height at"),
        (LONG, "a number of the formula is too large: at most 1.8e308"),
        ("1e400*x", "a number of the formula is too large: at most 1.8e308"),
        ("x + " * 200 + "1", "a formula has at most 500 characters, this one has 801"),
    ],
)
def test_a_surface_that_has_no_height_somewhere_is_refused_with_the_place(height, words):
    profile = f"{{kind: formula, height: '{height}', length: 12 mm}}"
    _, path, message = only(("  points: 21", f"  points: 21\n  surface: {{profile: {profile}, preload: 8 mm}}"))
    assert path == "analysis.surface.profile.height"
    assert words in message


EXTREMES = ("1e12", "-1e12", "1e29", "1e-29", "1e300", "-1", "9" * 30, LONG)


def test_every_number_of_a_spec_at_extremes_is_read_or_refused():
    """Nothing else than a specification or its error comes of it; what would need memory for it ran for minutes."""
    text = (CONFIGS / "beam_end_effector.yaml").read_text()
    for match in re.finditer(r"(?<=[:\[,] )-?[0-9]+(?:[.][0-9]+)?(?= ?[a-zA-Z]*[,}\]\n])", text):
        for value in EXTREMES:
            refused = messages(text[: match.start()] + value + text[match.end() :])
            assert all(len(message) < 300 for message in refused)


def messages(text):
    """Return what a specification is refused with, nothing where it is taken."""
    try:
        cfmkit.loads(text)
    except SpecError as error:
        return [problem.message for problem in error.problems]
    return []
