"""Families of other packages in every verb, those that cannot be used, and the doctor."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import packages
import plugin_support
import pytest

import cfmkit
from cfmkit import families
from cfmkit.cli import options
from cfmkit.cli.main import main

SPRINGS = str(plugin_support.PLUGINS[0] / "configs" / "oblique_carrella2007.yaml")


@pytest.fixture
def site(tmp_path, monkeypatch):
    """An empty folder on the path of modules; the current folder is another one."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with packages.empty_site(tmp_path / "site", monkeypatch) as folder:
        yield folder


@pytest.mark.parametrize(
    ("arguments", "files"),
    [
        (("check", SPRINGS), ()),
        (("new", "oblique"), ("oblique.yaml",)),
        (("show", "oblique"), ()),
        (("show", "plateau_force"), ()),
        (("show", "carrella-2007"), ()),
        (("show", "references"), ()),
        (("schema", "oblique"), ()),
        (("schema",), ()),
        (("analyze", SPRINGS, "-o", "out"), ("out/curve.csv", "out/figures/loop.png", "out/figures/mechanism.png")),
        (("analyze", SPRINGS, "-o", "out", "--compare-fidelity", "--no-plots"), ("out/curve.csv",)),
        (("export", SPRINGS, "-o", "out"), ("out/oblique.dxf", "out/oblique.svg")),
        (("sweep", SPRINGS, "-o", "out", "--vary", "mechanism.half_span=40mm:60mm:5", "-j", "1"), ("out/results.csv",)),
        (("batch", SPRINGS, "-o", "out", "--no-plots"), ("out/results.csv",)),
    ],
    ids=lambda value: "-".join(value[:2]) if isinstance(value, tuple) and value and value[0].isalpha() else None,
)
def test_every_verb_works_for_a_family_of_another_package(site, arguments, files):
    assert main(list(arguments)) == 0
    assert [name for name in files if not Path(name).exists()] == []


def test_workers_know_the_families_of_other_packages(site):
    """Two processes have to start: 3 s."""
    vary = ("--vary", "mechanism.half_span=40mm:60mm:5")
    assert main(["sweep", SPRINGS, "-o", "out", *vary, "-j", "2", "--no-plots"]) == 0
    assert Path("out/results.csv").read_text().count("complete") == 5


def test_a_run_says_which_package_computed_it(site):
    assert main(["analyze", SPRINGS, "-o", "out", "--no-plots"]) == 0
    made = json.loads(Path("out/manifest.json").read_text())["spec"]["family"]
    assert made == families.origin("oblique")
    assert made["package"] == "cfmkit-oblique"
    assert len(made["content"]) == 64


def test_names_are_completed():
    assert options.families("ob") == ["oblique"]
    assert "oblique" in options.topics("obl")


def test_a_family_has_its_article(monkeypatch):
    record = families.family("oblique")
    monkeypatch.setattr("cfmkit.api.family", lambda _name: replace(record, design=None, outline=None))
    monkeypatch.setattr(
        "cfmkit.studies.comparison_of_fidelities.family", lambda _name: replace(record, models={"exact": ""})
    )
    with pytest.raises(cfmkit.UsageError, match=r"^an oblique mechanism cannot be designed"):
        cfmkit.design(SPRINGS)
    with pytest.raises(cfmkit.UsageError, match=r"^an oblique mechanism has no part"):
        cfmkit.drawing(SPRINGS)
    from cfmkit.studies import choices_of

    with pytest.raises(cfmkit.UsageError, match=r": an oblique mechanism has only one model"):
        choices_of(cfmkit.load(SPRINGS))
    assert families.family("cam").phrase == "a cam mechanism"


LINE = "warning  the family 'broken' of the package broken-one 1.0 cannot be used: it cannot be imported: "


REQUEST = ("suggest", "--force", "10 N", "--travel", "3 mm", "--envelope", "80x60x6mm", "-o", "out", "--no-plots")


def one_by_one(work, jobs, _stopping):
    """Do jobs in this process."""
    yield from ((job, work(job)) for job in jobs)


@pytest.mark.parametrize("arguments", [("show",), ("show", "references"), ("show", "pla"), ("schema",), REQUEST])
def test_a_verb_that_tells_of_all_families_skips_a_broken_one_with_one_line(site, arguments, capsys, monkeypatch):
    """Of the request in this process, and without the families of cfmkit, which search for seconds."""
    monkeypatch.setattr("cfmkit.studies.suggest.search.names", lambda: ("oblique", "broken"))
    monkeypatch.setattr("cfmkit.studies.suggest.search.give_up_at", lambda _executor, _deadline: one_by_one)
    packages.install(site, "broken-one", "import nowhere_to_be_found\n", "broken")
    code = 4 if arguments is REQUEST else 0
    assert main(list(arguments)) == code
    out, err = capsys.readouterr()
    assert [line for line in err.splitlines() if line.startswith(LINE)] == err.splitlines()
    assert err.count("\n") == 1
    assert "doctor" in err
    assert "broken" not in out
    assert main([*arguments, "--json"]) == code
    (reported,) = json.loads(capsys.readouterr().out)["warnings"]
    assert reported["name"] == "family_skipped"


@pytest.mark.parametrize(
    "arguments", [("show", "cam"), ("show", "units"), ("new", "cam", "-o", "-"), ("schema", "cam"), ("check", SPRINGS)]
)
def test_a_verb_that_needs_no_other_family_does_not_import_a_broken_one(site, arguments, capsys):
    module = packages.install(site, "broken-one", "raise SystemExit('imported')\n", "broken")
    assert main(list(arguments)) == 0
    assert "broken" not in capsys.readouterr().err
    assert module not in sys.modules


OF_ITS_OWN = "class Odd(BaseException):\n    def __str__(self):\n        raise OSError\nraise Odd\n"
SOURCES = {
    "KeyboardInterrupt": "raise KeyboardInterrupt\n",
    "SystemExit": "import sys\nsys.exit(0)\n",
    "GeneratorExit": "raise GeneratorExit\n",
    "Odd": OF_ITS_OWN,
    "RecursionError": "def f():\n    f()\nf()\n",
    "AttributeError": "def __getattr__(name):\n    raise AttributeError('no ' + name)\n",
    "KeyError": "def __getattr__(name):\n    raise KeyError(name)\n",
    "ZeroDivisionError": packages.RECORD
    + "from cfmkit.families.base import Family\n"
    + "class Late(Family):\n    @property\n    def phrase(self):\n        return ''\n"
    + "    def __getattribute__(self, name):\n        if name == 'summary':\n            1 / 0\n"
    + "        return object.__getattribute__(self, name)\n"
    + "FAMILY = Late(**(vars(SPARE) | {'name': 'broken', 'interface': 1}))\n",
    "TypeError": "from cfmkit.families.base import Family\nFAMILY = Family(name='broken')\n",
}


@pytest.mark.parametrize("arguments", [("show",), ("show", "force_ripple"), ("schema",), ("doctor",)])
@pytest.mark.parametrize("kind", SOURCES)
def test_whatever_a_package_raises_ends_no_verb(site, kind, arguments, capsys):
    packages.install(site, "broken-one", SOURCES[kind], "broken")
    assert main(list(arguments)) == 0
    found = capsys.readouterr()
    said = " ".join((found.out + found.err).split())
    assert "the family 'broken' of the package broken-one 1.0" in said
    assert f"it cannot be imported: {kind}" in said


@pytest.mark.parametrize(
    "change",
    [
        "summary=None", "spec_type=None", "spec_type=int", "models={}", "models=None", "models={'a': 3}",
        "models={'a': 'module:function'}", "outputs=None", "outputs=ResultNames(values=None)",
        "outputs=ResultNames(values={'a': 'force'})", "outputs=ResultNames(values={'a': ('force',)})",
        "outputs=ResultNames(words={'a': 'b'})", "outputs=ResultNames(findings={'a': 3})",
        "outputs=ResultNames(headline=('a', 3))", "design=3", "design=DesignMethod(3)",
        "design=DesignMethod(print, levels='force')", "draw=3", "draw=Pictures(3)", "outline='module'", "elastic=3",
        "free=None", "folder=3", "folder='nowhere/x'", "folder='cfmkit/nowhere'", "block_shares='yes'", "search={}",
    ],
)  # fmt: skip
def test_a_record_that_is_not_what_the_verbs_rely_on_is_skipped(site, change, capsys):
    packages.install(
        site, "broken-one", f"{packages.RECORD}FAMILY = replace(SPARE, name='broken', interface=1, {change})", "broken"
    )
    assert main(["doctor", "--json"]) == 0
    (found,) = (one for one in json.loads(capsys.readouterr().out)["families"] if one["name"] == "broken")
    assert found["state"] == "skipped"
    assert change.partition("=")[0] in found["reason"] or "cannot be imported" in found["reason"]
    for verb in (("show",), ("show", "references"), ("schema",)):
        assert main(list(verb)) == 0


def test_control_c_while_a_package_is_imported_is_no_fault_of_the_package(site):
    """In a program that leaves signals to Python, and in the command line."""
    source = "import signal\nsignal.raise_signal(signal.SIGINT)\n"
    packages.install(site, "broken-one", source, "broken")
    body = "try:\n    list_skipped()\nexcept KeyboardInterrupt:\n    print('ended')\n"
    code = f"from cfmkit.families import list_skipped\n{body}"
    environment = os.environ | {"PYTHONPATH": str(site)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60, env=environment
    )
    assert (done.stdout, done.stderr) == ("ended\n", "")
    program = [sys.executable, "-c", "import sys; from cfmkit.cli.main import entry; sys.exit(entry())", "show"]
    done = subprocess.run(program, capture_output=True, text=True, check=False, timeout=60, env=environment)
    assert (done.returncode, done.stderr) == (130, "error    interrupted\n")


@pytest.mark.parametrize("arguments", [("new", "broken"), ("show", "broken"), ("schema", "broken")])
def test_a_broken_family_by_its_name_is_a_usage_error_with_the_reason(site, arguments, capsys):
    packages.install(site, "broken-one", packages.record("broken", 7), "broken")
    assert main(list(arguments)) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "is for interface 7, this cfmkit has interface 1" in err


def test_a_specification_of_a_broken_family_is_invalid_at_that_place(site, capsys):
    packages.install(site, "broken-one", "import nowhere_to_be_found\n", "broken")
    Path("x.yaml").write_text("cfmkit: 1\nfamily: broken\n")
    assert main(["check", "x.yaml"]) == 3
    assert capsys.readouterr().err.startswith("x.yaml:2:9: family: the family 'broken' of the package broken-one")


def test_the_doctor_says_why_a_family_is_skipped(site, capsys):
    packages.install(site, "broken-one", "import nowhere_to_be_found\n", "broken")
    for package in ("one-more", "another-one"):
        packages.install(site, package, packages.record("twin"), "twin")
    packages.install(site, "other-cam", packages.record("cam"), "cam")
    assert main(["doctor"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    assert "No module named 'nowhere_to_be_found'" in page
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    state = {(one["name"], one["package"]): one["state"] for one in found["families"]}
    assert state["cam", "cfmkit"] == state["oblique", "cfmkit-oblique"] == "ok"
    skipped = {("broken", "broken-one"), ("twin", "one-more"), ("twin", "another-one"), ("cam", "other-cam")}
    assert {key for key, word in state.items() if word == "skipped"} == skipped
    assert len(found["warnings"]) == 4


def test_the_doctor_knows_versions_folders_and_the_solver(site, capsys):
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["versions"]["cfmkit"] == cfmkit.__version__
    assert {"numpy", "scipy"} <= {one["name"] for one in found["packages"] if one["version"]}
    assert all(one["writable"] for one in found["folders"])
    assert found["message"] == "nothing is wrong"
    assert main(["doctor"]) == 0
    assert capsys.readouterr().out.endswith("nothing is wrong\n")


def test_the_doctor_says_what_the_beam_engine_runs_on(site, monkeypatch, capsys):
    monkeypatch.setenv("CFMKIT_WITHOUT_C", "1")
    assert main(["doctor", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["solver"] == {"engine": "numpy", "switched_off": True}
    assert main(["doctor"]) == 0
    assert "CFMKIT_WITHOUT_C is set" in capsys.readouterr().out


def test_the_doctor_finds_a_folder_that_cannot_be_written_to(site, monkeypatch, capsys):
    monkeypatch.setattr("cfmkit.cli.verbs.doctor.os.access", lambda _path, _mode: False)
    assert main(["doctor"]) == 0
    assert "cannot be written to" in capsys.readouterr().out


def test_the_doctor_compares_what_is_installed_with_what_is_needed(monkeypatch, capsys):
    """A minimum that pip was told to ignore: typer 0.18 said 'cfmkit: 1 is not allowed here, only 1 is'."""
    versions = {"numpy": "1.26.4", "typer": "0.18.0"}
    real = importlib.metadata.version
    needed = ["numpy>=2.0", "typer>=0.26.8", "scipy>=1.14", "distributed>=2999.1; extra == 'cluster'"]
    monkeypatch.setattr(importlib.metadata, "version", lambda name: versions.get(name) or real(name))
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: needed)
    assert main(["doctor", "--json"]) == 0
    told = [one["message"] for one in json.loads(capsys.readouterr().out)["warnings"]]
    assert "numpy 1.26.4 does not work with this cfmkit: pip install 'numpy>=2.0'" in told
    assert "typer 0.18.0 does not work with this cfmkit: pip install 'typer>=0.26.8'" in told
    assert not any("scipy" in one for one in told)


def test_the_doctor_knows_of_a_folder_without_file_locks(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("cfmkit.store.lock._try_to_lock", lambda _: None)
    monkeypatch.chdir(tmp_path)
    assert main(["doctor"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert f"no file locks in {tmp_path}: .cfmkit.softlock marks a live run" in printed
