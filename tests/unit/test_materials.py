import math

import pytest

from cfmkit import materials
from cfmkit.errors import ExitCode
from cfmkit.materials import MATERIALS, Material, UnknownMaterial, material

EVERY = pytest.mark.parametrize("item", MATERIALS.values(), ids=lambda item: item.name)


def test_no_two_entries_of_the_library_share_a_name():
    entries = (*materials._METALS, *materials._PLASTICS, *materials._PAPERS)
    assert len({item.name for item in entries}) == len(entries) == len(MATERIALS)


def test_an_alias_is_never_the_name_of_another_material():
    assert not {alias for item in MATERIALS.values() for alias in item.aliases} & set(MATERIALS)


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

    steels = [item for key, item in MATERIALS.items() if key.startswith("steel")]
    assert width(material(name)) > 2 * max(map(width, steels))


def test_lan_2010_table_2():
    pom = material("pom-lan-2010")
    assert (pom.youngs_modulus, pom.yield_strength) == (2e9, 76e6)
    assert pom.yield_strength is not None
    assert pom.yield_strength / 1.58 == pytest.approx(48.1013e6, rel=1e-6)  # the stress limit printed in sec. 2


def test_ding_2022_section_6():
    pla = material("pla-ding-2022")
    assert (pla.youngs_modulus, pla.poisson_ratio, pla.density) == (1.477e9, 0.3, 1250)
    assert pla.yield_strength is None


def test_bilancia_2019_section_2_2():
    abs_plastic = material("abs-bilancia-2019")
    assert (abs_plastic.youngs_modulus, abs_plastic.poisson_ratio, abs_plastic.yield_strength) == (1.8e9, 0.35, 42.5e6)


def test_li_hao_2019_section_7():
    assert material("steel-85-li-hao-2019").youngs_modulus == 200e9


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


def test_a_name_that_resembles_nothing_gets_the_whole_list():
    with pytest.raises(UnknownMaterial) as caught:
        material("wool")
    assert all(name in str(caught.value) for name in MATERIALS)


def test_an_unknown_material_is_an_invalid_value_for_the_command_line_and_a_value_error_for_validators():
    with pytest.raises(ValueError, match="no material") as caught:
        material("x")
    assert caught.value.exit_code is ExitCode.INVALID


def test_the_library_cannot_be_changed():
    with pytest.raises(TypeError):
        MATERIALS["pla"] = material("abs")  # type: ignore[index]
