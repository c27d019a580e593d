import math
from pathlib import Path

import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import ExitCode, SpecError
from cfmkit.stock import MATERIALS_BY_NAME, Material, UnknownMaterial, material, materials

CONFIGS = Path(__file__).parents[2] / "configs"

EVERY = pytest.mark.parametrize("item", MATERIALS_BY_NAME.values(), ids=lambda item: item.name)


def test_no_two_entries_of_the_library_share_a_name():
    entries = (*materials._METAL_LIST, *materials._PLASTIC_LIST, *materials._PUBLISHED_LIST)
    assert len({item.name for item in entries}) == len(entries) == len(MATERIALS_BY_NAME)


def test_an_alias_is_never_the_name_of_another_material():
    assert not {alias for item in MATERIALS_BY_NAME.values() for alias in item.aliases} & set(MATERIALS_BY_NAME)


@EVERY
def test_every_material_is_found_under_its_own_name(item: Material):
    assert material(item.name) is item


@EVERY
def test_every_material_says_where_its_numbers_come_from(item: Material):
    assert len(item.source) > 20
    assert item.source.endswith(".")


@EVERY
def test_the_scatter_contains_the_nominal_values_and_has_a_width(item: Material):
    low, high = item.scatter.youngs_modulus
    assert low <= item.youngs_modulus <= high
    assert low < high
    if item.yield_strength is None:
        assert item.scatter.yield_strength is None
    else:
        assert item.scatter.yield_strength is not None
        low, high = item.scatter.yield_strength
        assert low <= item.yield_strength <= high
        assert low < high


@EVERY
def test_a_stated_spread_contains_its_value_and_has_a_width(item: Material):
    for value, ends in [(item.poisson_ratio, item.scatter.poisson_ratio), (item.density, item.scatter.density)]:
        if ends is not None:
            assert ends[0] <= value <= ends[1]
            assert ends[0] < ends[1]


def test_the_page_says_in_words_where_no_spread_is_stated(capsys: pytest.CaptureFixture[str]):
    assert run_command(["show", "materials"]) == 0
    shown = capsys.readouterr().out
    assert shown.count("none stated") == sum(
        ends is None
        for item in MATERIALS_BY_NAME.values()
        for ends in (item.scatter.poisson_ratio, item.scatter.density)
    )


@EVERY
def test_every_material_is_physically_possible(item: Material):
    assert 0 < item.poisson_ratio < 0.5
    assert 800 < item.density < 9000
    assert 1e7 < item.youngs_modulus < 3e11
    # SI and not MPa or GPa: no solid here yields above 4 % (elastomers: 50 %) strain or below 0.05 %
    if item.yield_strength is not None:
        assert 5e-4 < item.yield_strength / item.youngs_modulus < (0.5 if item.name.startswith("tpu") else 0.04)


@EVERY
def test_the_speed_of_sound_is_that_of_a_solid(item: Material):
    assert 100 < math.sqrt(item.youngs_modulus / item.density) < 6000


@pytest.mark.parametrize("name", ["pla", "abs", "petg", "pa12-sls", "pa12-mjf"])
def test_printed_plastics_scatter_more_than_any_steel(name: str):
    def width(item: Material) -> float:
        low, high = item.scatter.youngs_modulus
        return (high - low) / item.youngs_modulus

    steels = [item for key, item in MATERIALS_BY_NAME.items() if key.startswith("steel")]
    assert width(material(name)) > 2 * max(map(width, steels))


@pytest.mark.parametrize(
    ("name", "young", "poisson", "strength"),
    [
        ("pom-lan-2010", 2e9, 0.35, 76e6),  # Table 2
        ("pla-ding-2022", 1.477e9, 0.3, None),  # sec. 6
        ("abs-bilancia-2019", 1.8e9, 0.35, 42.5e6),  # sec. 2.2
        ("steel-85-li-hao-2019", 200e9, 0.30, 980e6),  # sec. 7, and GB/T 1222
    ],
)
def test_materials_of_papers_have_the_values_printed_there(name, young, poisson, strength):
    item = material(name)
    assert (item.youngs_modulus, item.poisson_ratio, item.yield_strength) == (young, poisson, strength)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("delrin", "'pom'"),
        ("PLA", "'pla'"),
        ("pla-ding", "'pla-ding-2022'"),
        ("HDPE", "'pe-hd'"),
        ("aisi 304", "'steel-304'"),
        ("titanium_6al_4v", "'titanium-6al-4v'"),
        ("pa12", "'pa12-sls' or 'pa12-mjf'"),
        ("alumnium-7075-t6", "'aluminium-7075-t6'"),
    ],
)
def test_a_near_miss_is_named(typed: str, meant: str):
    with pytest.raises(UnknownMaterial, match="did you mean") as caught:
        material(typed)
    assert meant in str(caught.value)


def test_a_name_that_resembles_nothing_gets_the_command_that_lists_the_names():
    with pytest.raises(UnknownMaterial, match="`cfmkit show materials` lists them"):
        material("wool")


def test_an_unknown_material_is_an_invalid_value_for_the_command_line_and_a_value_error_for_validators():
    with pytest.raises(ValueError, match="no material") as caught:
        material("x")
    assert caught.value.exit_code is ExitCode.INVALID


def test_the_library_cannot_be_changed():
    with pytest.raises(TypeError):
        MATERIALS_BY_NAME["pla"] = material("abs")  # type: ignore[index]


EVERYWHERE = {
    "beam_lan2010": "mechanism.material",
    "vcfm_ding2022": "mechanism.material",
    "slider_crank_strip": "mechanism.material",
    "cam": "mechanism.contact.material",
}
"""Where the four families say what a part is made of, by a config that does."""

ONE_MATERIAL = ("pla", "{name: pla}", "{youngs_modulus: 3 GPa, poisson_ratio: 0.36, yield_strength: 45 MPa}")
"""The same material by its name, as a block, and by its values."""


def made_of(stem: str, text: str, *more: str):
    """Return a config's specification with another material, and that material."""
    contact = ["mechanism.contact.width=8 mm"] if stem == "cam" else []
    spec = cfmkit.load(CONFIGS / f"{stem}.yaml", [*contact, f"{EVERYWHERE[stem]}={text}", *more])
    return spec, spec.get_value(EVERYWHERE[stem])


@pytest.mark.parametrize("stem", EVERYWHERE)
def test_a_material_is_a_name_a_block_or_values_alike_in_every_family(stem: str):
    found = [made_of(stem, text)[1] for text in ONE_MATERIAL]
    assert {(one.modulus, one.poisson, one.yield_strength) for one in found} == {(3e9, 0.36, 45e6)}
    changed = made_of(stem, "{name: pla, youngs_modulus: 2.5 GPa}")[1]
    assert (changed.modulus, changed.poisson, changed.yield_strength) == (2.5e9, 0.36, 45e6)
    assert made_of(stem, "{youngs_modulus: 3 GPa}")[1].poisson == 0.3


@pytest.mark.parametrize("stem", EVERYWHERE)
def test_a_value_of_a_bare_name_can_be_set_and_replaced_and_another_name_brings_its_own_values(stem: str):
    path = EVERYWHERE[stem]
    _, changed = made_of(stem, "pla", f"{path}.youngs_modulus=2.5 GPa")
    assert (changed.name, changed.modulus) == ("pla", 2.5e9)
    named, _ = made_of(stem, "pla")
    assert dict(named.leaves())[f"{path}.youngs_modulus"] == 3e9
    assert named.replace({f"{path}.youngs_modulus": 2.5e9}).get_value(path) == changed
    assert named.replace({f"{path}.name": "pom"}).get_value(path) == named.replace({path: "pom"}).get_value(path)
    assert named.replace({path: "pom"}).get_value(path).modulus == material("pom").youngs_modulus


@pytest.mark.parametrize("complete", [False, True])
@pytest.mark.parametrize("stem", EVERYWHERE)
def test_a_material_is_written_in_one_form_and_reads_back(stem: str, complete: bool, monkeypatch):
    monkeypatch.chdir(CONFIGS)  # where data files are sought
    for text in ONE_MATERIAL:
        spec, found = made_of(stem, text)
        written = cfmkit.dumps(spec, complete)
        assert "material:\n" in written
        assert ("poisson_ratio: 0.36" in written) == (complete or "poisson" in text)
        assert cfmkit.loads(written).get_value(EVERYWHERE[stem]) == found


@pytest.mark.parametrize("stem", EVERYWHERE)
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("pon", "did you mean 'pom'"),
        ("{name: pon}", "did you mean 'pom'"),
        ("{name: wool, youngs_modulus: 3 GPa}", "one of your own has 'youngs_modulus' in place of 'name'"),
        ("5", "5 is no material: give a name from `show materials`, or values such as"),
        ("{poisson_ratio: 0.3}", "needs 'name' or 'youngs_modulus'"),
        ("{youngs_modulos: 3 GPa}", "did you mean 'youngs_modulus'?"),
        ("{youngs_modulus: 0 GPa}", "must be > 0"),
    ],
)
def test_a_material_that_is_none_is_refused_in_one_line(stem: str, text: str, words: str):
    with pytest.raises(SpecError) as caught:
        made_of(stem, text)
    (problem,) = caught.value.problems
    assert words in problem.message


@pytest.mark.parametrize("stem", [stem for stem in EVERYWHERE if stem != "cam"])
def test_the_allowable_stress_is_the_yield_strength_over_the_safety_factor_in_every_family(stem: str):
    values = ONE_MATERIAL[2]
    plain, _ = made_of(stem, values, "mechanism.safety_factor=1")
    assert type(plain.mechanism).model_fields["safety_factor"].default == 1.0
    short = ["analysis.points=5"]
    for factor in (1, 1.5):
        result = cfmkit.analyze(made_of(stem, values, f"mechanism.safety_factor={factor}", *short)[0])
        assert result.allowable_stress == 45e6 / factor
        assert result.values["allowable_stress"].value == 45e6 / factor


def test_the_old_word_of_vcfm_for_the_allowable_stress_is_refused_with_that_of_today():
    with pytest.raises(SpecError, match="'allowable_stress' was removed; write 'yield_strength'"):
        made_of("vcfm_ding2022", "{name: pla, allowable_stress: 30 MPa}")
