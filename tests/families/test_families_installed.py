"""Families of other packages: found, refused with a reason, and imported only when they are needed."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import packages
import pytest

import cfmkit
from cfmkit import families
from cfmkit.families import entry_point_plugins
from cfmkit.families.base import INTERFACE_VERSION

pytestmark = pytest.mark.lists

GROUP = "cfmkit.families"
OLD = "\n".join(["cfmkit: 1", "family: {}", "mechanism: {{stiffness: 2 N/mm}}", ""])


@pytest.fixture
def site(tmp_path, monkeypatch):
    """An empty folder on the path of modules."""
    with packages.empty_site(tmp_path / "site", monkeypatch) as folder:
        yield folder


def reason(name):
    with pytest.raises(families.Unusable) as caught:
        families.family(name)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize("kind", ["dist", "egg"])
def test_a_family_of_another_package_is_one_like_the_others(site, kind):
    packages.install(site, "more-springs", packages.record("soft"), "soft", kind=kind)
    assert families.names()[-1] == "soft"
    assert families.family("soft").name == "soft"
    assert "soft" in [one.name for one in families.records()]
    assert families.list_skipped() == ()


def test_listing_imports_nothing(site):
    module = packages.install(site, "more-springs", "raise SystemExit('imported')\n", "soft")
    assert "soft" in families.names()
    assert module not in sys.modules


def test_what_is_found_is_what_the_standard_library_finds(site):
    packages.install(site, "more-springs", "", "soft", "softer = more_springs:OTHER", "# hard = a:b")
    packages.install(site, "Other.Package", "", "hard", kind="egg")
    found = {(one.name, one.target) for one in entry_point_plugins.offers()}
    assert found == {(one.name, one.value) for one in importlib.metadata.entry_points(group=GROUP)}
    assert {"soft", "softer", "hard"} <= {name for name, _ in found}


def test_of_a_package_that_is_on_the_path_twice_the_first_one_counts(site, tmp_path, monkeypatch):
    packages.install(site, "more-springs", packages.record("soft"), "soft")
    first = tmp_path / "first"
    first.mkdir()
    packages.install(first, "more-springs", packages.record("softer"), "softer")
    monkeypatch.syspath_prepend(str(first))
    assert families.names()[-1] == "softer"
    assert "soft" not in families.names()


@pytest.mark.parametrize(
    ("source", "reported"),
    [
        ("import a_module_that_is_not_there\n", "ModuleNotFoundError: No module named 'a_module_that_is_not_there'"),
        ("FAMILY = 1 / 0\n", "it cannot be imported: ZeroDivisionError: division by zero"),
        ("raise SystemExit('two\\nlines')\n", "it cannot be imported: SystemExit: two lines"),
        ("RECORD = 1\n", "it cannot be imported: AttributeError"),
        ("FAMILY = {}\n", "broken_one:FAMILY is a dict, not a Family"),
        (packages.record("other"), "its record is called 'other'"),
        (packages.record("broken", 99), f"is for interface 99, this cfmkit has interface {INTERFACE_VERSION}"),
        (packages.record("broken", None), "its record does not state its interface; this cfmkit has 'interface=1'"),
        (packages.RECORD + "FAMILY = replace(SPARE, wheels=3)\n", "unexpected keyword argument 'wheels'"),
    ],
    ids=["module", "error", "exit", "nothing", "kind", "name", "newer", "unstated", "field"],
)
def test_a_family_that_cannot_be_used_is_skipped_with_the_reason(site, source, reported):
    packages.install(site, "broken-one", source, "broken")
    assert reported in reason("broken")
    assert reason("broken").startswith("the family 'broken' of the package broken-one 1.0 cannot be used: ")
    assert families.list_skipped() == (reason("broken"),)
    assert {"cam", "beam"} <= {one.name for one in families.records()}


def test_a_name_that_cfmkit_has_stays_its_own(site):
    packages.install(site, "another-cam", packages.record("cam"), "cam")
    assert families.family("cam").spec_type.__module__ == "cfmkit.families.cam.spec"
    assert families.names().count("cam") == 1
    assert "cfmkit itself has a family of this name" in families.list_skipped()[0]


def test_of_two_packages_with_the_same_name_neither_is_used(site):
    for package in ("one-package", "other-package"):
        packages.install(site, package, packages.record("twin"), "twin")
    assert "twin" not in families.names()
    assert "other-package offers one of this name, too" in reason("twin")
    assert len(families.list_skipped()) == 2


def test_a_specification_of_a_family_that_cannot_be_used_says_why_at_its_place(site, tmp_path):
    packages.install(site, "broken-one", "import nowhere_to_be_found\n", "broken")
    path = tmp_path / "x.yaml"
    path.write_text(OLD.format("broken"))
    with pytest.raises(cfmkit.SpecError) as caught:
        cfmkit.load(path)
    (problem,) = caught.value.problems
    assert (problem.line, problem.column, problem.path) == (2, 9, "family")
    assert "No module named 'nowhere_to_be_found'" in problem.message


def test_a_specification_of_a_family_that_is_here_asks_no_other_package(monkeypatch):
    def offers():
        raise AssertionError("packages were listed")

    monkeypatch.setattr(entry_point_plugins, "offers", offers)
    spec = cfmkit.load(Path(__file__).parents[2] / "configs" / "cam.yaml")
    assert cfmkit.analyze(spec).status.usable
    assert families.origin("cam") == {}


def test_what_a_package_prints_while_it_is_imported_is_no_result(site, capsys):
    packages.install(site, "loud-one", "print('hello')\n" + packages.record("loud"), "loud")
    families.family("loud")
    assert capsys.readouterr() == ("", "hello\n")


def test_what_was_computed_by_other_code_of_a_package_is_not_reused(site, tmp_path):
    module = packages.install(site, "more-springs", packages.record("soft"), "soft")
    before = families.origin("soft")
    assert (before["package"], before["version"]) == ("more-springs", "1.0")
    with (site / f"{module}.py").open("a") as file:
        file.write("# changed\n")
    assert families.origin("soft")["content"] != before["content"]
    assert families.origin("cam") == {}


@pytest.mark.parametrize("target", ["", ":", "no module:x", "module_that_is_not_there:x", ".:x"])
def test_an_entry_point_that_names_no_module_breaks_nothing(site, target):
    packages.install(site, "odd-one", "", f"odd = {target}")
    assert "cannot be imported" in reason("odd")
    assert families.origins()["odd"]["content"] == ""


LIST = """
import sys
sys.path.insert(0, sys.argv[1])
import cfmkit.families
names = cfmkit.families.names()
print("soft" in names, "importlib.metadata" in sys.modules, "numpy" in sys.modules)
"""


def test_listing_among_five_hundred_packages_imports_neither_numpy_nor_metadata(site):
    for number in range(500):
        info = site / f"package_{number}-1.0.dist-info"
        info.mkdir()
        (info / "entry_points.txt").write_text("[console_scripts]\nprogram = module:function\n")
    packages.install(site, "more-springs", "", "soft")
    done = subprocess.run(
        [sys.executable, "-c", LIST, str(site)], capture_output=True, text=True, check=True, cwd=Path(__file__).parent
    )
    assert done.stdout.split() == ["True", "False", "False"]
