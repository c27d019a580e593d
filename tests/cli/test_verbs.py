"""The verbs that compute nothing: check, new, show, schema, export; and the help."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from cfmkit import families
from cfmkit._version import __version__

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
VERBS = ["design", "analyze", "export", "check", "new", "show", "schema", "doctor"]


def test_version_is_printed(cli):
    done = cli("--version")
    assert (done.code, done.out) == (0, f"cfmkit {__version__}\n")


def test_help_lists_the_verbs_in_the_order_of_work_and_the_exit_codes(cli):
    page = cli("--help").out
    places = [page.index(f"│ {verb} ") for verb in VERBS]
    assert places == sorted(places)
    assert "Exit codes: 0 ok, 2 usage" in " ".join(page.split())


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself_and_every_option(cli, verb):
    done = cli(verb, "--help", COLUMNS="200")
    assert done.code == 0
    assert "Traceback" not in done.out
    for option in ("--json", "--verbose", "--help"):
        assert option in done.out
    for internal in ("<bool>", "<int>", "<str>", "<list", "x>=", "<=x"):  # what types of Python are called, and limits
        assert internal not in done.out


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (("analyze", "cam.yaml", "--seed", "-1"), "'--seed': -1 is not allowed: must be >= 0"),
        (("sensitivity", "cam.yaml", "--samples", "1"), "'--samples': 1 is not allowed: must be >= 2"),
        (("sweep", "cam.yaml", "-j", "0"), "'-j' / '--jobs': 0 is not allowed: must be >= 1"),
        (("design", "cam.yaml", "--seed", str(2**63)), f"{2**63} is not allowed: must be <= {2**63 - 1}"),
    ],
)
def test_a_number_out_of_its_limits_is_refused_with_them(cli, arguments, reported):
    done = cli(*arguments)
    assert done.code == 2
    assert reported in done.err


@pytest.mark.parametrize(
    ("verb", "reported"),
    [
        ("batch", "What to do with every spec; default: design where there is a block design, else analyze."),
        ("batch", "Output folder; default: cfm-out/batch/."),
        ("measure", "Output folder; default: cfm-out/DATA-measure/."),
        ("sensitivity", "(the tolerances that a yield needs); default: the spec's, else oat."),
    ],
)
def test_the_help_names_the_defaults(cli, verb, reported):
    page = cli(verb, "--help", COLUMNS="200").out
    assert reported in " ".join(page.replace("│", " ").split())


@pytest.mark.parametrize("verb", ["check", "new", "show", "schema", "export"])
@pytest.mark.parametrize("option", ["--seed=1", "--no-plots", "--fidelity=x"])
def test_a_verb_refuses_options_that_would_do_nothing(cli, cam, verb, option):
    assert cli(verb, "cam", option).code == 2


def test_python_m_cfmkit_is_the_same_program(cli):
    import subprocess
    import sys

    done = subprocess.run([sys.executable, "-m", "cfmkit", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == cli("--version").out


def test_check_has_one_line_for_each_file(cli):
    done = cli("check", *map(str, CONFIGS))
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines] == list(map(str, CONFIGS))
    assert all(line.split()[1] == "ok" for line in lines)


def test_check_reports_every_fault_of_every_file(cli, cam):
    (cli.folder / "one.yaml").write_text("family: cam\nmechanism: 1\nrequirements:\n  - {metric: riple, max: 1}\n")
    (cli.folder / "two.yaml").write_text("family: cam\n")
    done = cli("check", "one.yaml", cam, "two.yaml")
    assert done.code == 3
    assert [line.split(":")[0] for line in done.err.splitlines()] == ["one.yaml", "one.yaml", "two.yaml"]
    assert [line.split()[:2] for line in done.out.splitlines()] == [
        ["one.yaml", "INVALID"],
        ["cam.yaml", "ok"],
        ["two.yaml", "INVALID"],
    ]


def test_check_of_a_folder_is_that_of_all_files_in_it_and_below(cli, cam):
    (cli.folder / "all" / "below" / "cfm-out").mkdir(parents=True)
    text = (cli.folder / cam).read_text()
    for name in ("all/b.yaml", "all/below/a.yml", "all/below/cfm-out/resolved.yaml"):
        (cli.folder / name).write_text(text)
    (cli.folder / "all" / "below" / "bad.yaml").write_text("family: cam\n")
    done = cli("check", "all", cam)
    assert done.code == 3
    assert [line.split()[:2] for line in done.out.splitlines()] == [
        ["all/b.yaml", "ok"],
        ["all/below/a.yml", "ok"],
        ["all/below/bad.yaml", "INVALID"],
        [cam, "ok"],
    ]
    (cli.folder / "empty").mkdir()
    done = cli("check", "empty")
    assert (done.code, "no YAML file" in done.err) == (2, True)


def test_check_goes_on_after_a_missing_file(cli, cam):
    done = cli("check", "nowhere.yaml", cam)
    assert done.code == 2
    assert "ok" in done.out
    (cli.folder / "bad.yaml").write_text("family: cam\n")
    assert cli("check", "nowhere.yaml", "bad.yaml").code == 3


def test_check_finds_a_bound_in_the_wrong_dimension(cli, cam):
    done = cli("check", cam, "--set", "requirements.2.max=140 N")
    assert done.code == 3
    assert "requirements.2.max" in done.err
    assert "a length" in done.err


def test_check_under_json_has_a_record_for_each_file(cli, cam):
    done = cli("check", cam, "nowhere.yaml", "--json")
    assert done.code == done.document["exit_code"] == 2
    assert [(item["file"], item["ok"]) for item in done.document["files"]] == [(cam, True), ("nowhere.yaml", False)]
    assert done.document["message"] == "1 of 2 files are not valid"


def test_check_writes_nothing_and_quiet_says_nothing(cli, cam):
    assert cli("check", cam, "-q").out == ""
    assert [path.name for path in cli.folder.iterdir()] == [cam]


@pytest.mark.parametrize("family", families.names())
def test_new_writes_a_spec_that_passes_as_it_is(cli, family):
    made = cli("new", family)
    assert (made.code, made.err) == (0, "")
    name = f"{family}.yaml"
    assert made.out.split()[:2] == ["written", f"{name},"]
    assert cli("check", name).code == 0
    assert cli("analyze", name, "--no-plots", "-q").code == 0
    if families.family(family).design:
        assert cli("design", name, "--no-plots", "-q").code == 0


def test_new_never_replaces_a_file(cli, cam):
    (cli.folder / cam).write_text("mine")
    for arguments in (("new", "cam"), ("new", "cam", "-o", cam)):
        done = cli(*arguments)
        assert done.code == 7
        assert "the file exists" in done.err
    assert (cli.folder / cam).read_text() == "mine"


def test_new_prints_the_spec_where_it_is_asked_to(cli):
    done = cli("new", "cam", "-o", "-")
    assert yaml.safe_load(done.out)["family"] == "cam"
    assert list(cli.folder.iterdir()) == []
    assert cli("new", "cam", "-o", "-", "--json").document["text"] == done.out


def test_new_into_a_folder_that_is_not_there_is_exit_7(cli):
    assert cli("new", "cam", "-o", "a/b.yaml").code == 7


def test_new_names_the_family_that_was_probably_meant(cli):
    done = cli("new", "came")
    assert done.code == 2
    assert "did you mean 'cam'?" in done.err


def test_show_lists_families_and_topics(cli):
    page = cli("show").out
    for word in (*families.names(), "units", "metrics", "materials"):
        assert f"  {word} " in page


@pytest.mark.parametrize("family", families.names())
def test_show_explains_every_key_value_and_finding_of_a_family(cli, family):
    record = families.family(family)
    document = cli("show", family, "--json").document
    assert {item["name"] for item in document["findings"]} == set(record.outputs.findings)
    assert {item["name"] for item in document["values"]} == set(record.outputs.values)
    keys = {item["path"]: item for item in document["keys"]}
    assert all(item["kind"] and (item["description"] or path == "family") for path, item in keys.items())
    page = cli("show", family).out
    for name in (*record.outputs.findings, *record.outputs.values, *(path.rpartition(".")[2] for path in keys)):
        assert name in page
    assert record.papers[0].reference[:20] in page


def test_show_cam_says_kind_default_and_bounds_of_a_key(cli):
    keys = {item["path"]: item for item in cli("show", "cam", "--json").document["keys"]}
    assert keys["mechanism.brace_length"]["required"]
    assert keys["mechanism.brace_length"]["kind"] == "length"
    assert keys["mechanism.brace_length"]["allowed"] == "> 0"
    assert keys["mechanism.plate.top_margin"]["default"] == "10 mm"
    assert keys["mechanism.springs.stiffness"]["kind"] == "stiffness or list of stiffness"
    assert keys["design.choose"]["kind"] == "force-constant | stiffness | catalogue | preload"
    assert keys["design.catalogue[].name"]["kind"] == "text"
    assert keys["analysis.points"]["default"] == "481"


def test_show_units_lists_the_closed_list(cli):
    document = cli("show", "units", "--json").document
    sizes = {item["symbol"]: item["si"] for item in document["units"]}
    assert sizes["mm"] == 0.001
    assert sizes["lbf"] == pytest.approx(4.4482216152605)
    assert {item["symbol"] for item in document["units"] if item["input_only"]} >= {"in", "lbf", "lb", "psi"}
    assert " input only" in cli("show", "units").out


def test_show_metrics_gives_name_unit_and_definition(cli):
    document = cli("show", "metrics", "--json").document
    named = {item["name"]: item for item in document["metrics"]}
    assert named["hysteresis_area"]["unit"] == "N*mm"
    assert named["force_ripple"]["definition"].startswith("(max - min)/max")
    assert all(f"  {name} " in cli("show", "metrics").out for name in ("force_mean", "usable_stroke"))


def test_show_materials_gives_every_property_with_its_source(cli):
    document = cli("show", "materials", "--json").document
    pom = next(item for item in document["materials"] if item["name"] == "pom")
    assert pom["youngs_modulus"] == 2.8e9
    assert pom["source"]
    page = cli("show", "materials").out
    assert "2.5 ... 3.2" in page
    assumed = {item["name"] for item in document["materials"] if item["poisson_is_assumed"]}
    assert assumed == {"petg", "tpu-95a", "pom-lan-2010"}
    assert all("Poisson ratio" in item["source"] for item in document["materials"])
    assert " yield_strength" in page


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("pla", "materials", "yield_strength = 45"),
        ("delrin", "materials", "Polyoxymethylene"),
        ("force_ripple", "metrics", "(max - min)/max"),
        ("torque_mean", "metrics", "N*mm"),
        ("force_mean[load]", "metrics", "mean force"),
        ("spring_elongation_max", "values", "cam"),
        ("overstressed", "findings", "vcfm"),
        ("MPa", "units", "megapascal"),
        ("N*mm/deg", "dimensions", "torque per angle"),
        ("rotational stiffness", "dimensions", "N*mm/rad"),
        ("lan", "references", "lan-2010"),
        ("ding-2022", "references", "Robotica"),
    ],
)
def test_show_explains_whatever_has_a_name(cli, name, kind, words):
    done = cli("show", name)
    assert done.code == 0
    assert words in " ".join(done.out.split())
    assert cli("show", name, "--json").document[kind]


@pytest.mark.parametrize(
    ("typed", "meant"),
    [("PLA", "pla"), ("force_riple", "force_ripple"), ("overstresed", "overstressed"), ("ding-2021", "ding-2022")],
)
def test_show_names_what_was_probably_meant(cli, typed, meant):
    done = cli("show", typed)
    assert done.code == 2
    assert f"did you mean '{meant}'?" in done.err


@pytest.mark.parametrize(("name", "key"), [("lan-2006", "LanLee2006"), ("sanchez-salinas-2022", "SanchezSalinas2022")])
def test_a_paper_is_shown_with_its_own_bibtex_entry(cli, name, key):
    shown, (entry,) = cli("show", name).out, cli("show", name, "--json").document["bibtex"]
    assert entry.startswith("@article{" + key)
    assert entry in shown
    assert shown.count("@") == 1


def test_show_references_lists_the_papers_of_every_family(cli):
    document = cli("show", "references", "--json").document
    assert {item["family"] for item in document["references"]} == set(families.names())


@pytest.mark.parametrize("columns", [40, 60, 80, 300])
@pytest.mark.parametrize("topic", ["cam", "units", "metrics", "materials"])
def test_pages_keep_to_the_width_of_the_terminal(cli, topic, columns):
    lines = cli("show", topic, COLUMNS=str(columns)).out.splitlines()
    assert max(map(len, lines)) <= max(min(columns, 108), 40)


def test_schema_describes_every_config(cli):
    schema = json.loads(cli("schema").out)
    assert schema["$schema"].startswith("https://json-schema.org/")
    assert json.loads(cli("schema", "cam").out)["properties"]["family"]["const"] == "cam"
    assert cli("schema", "--json").document["schema"] == schema


def test_schema_of_an_unknown_family_is_a_document_too(cli):
    done = cli("schema", "kam", "--json")
    assert (done.code, done.document["status"]) == (2, "usage")


def test_export_writes_the_geometry_of_a_spec(cli, cam):
    done = cli("export", cam)
    assert (done.code, done.err) == (0, "")
    names = {path.name for path in (cli.folder / "cfm-out/cam-export").iterdir()}
    assert {"cam.dxf", "cam.svg", "manifest.json"} < names
    assert "cam-kerf.dxf" not in names


@pytest.mark.parametrize(
    ("config", "change", "reported"),
    [
        ("slider_crank_tapered", "mechanism.legs=8", "one of 8 equal legs is drawn"),
        ("slider_crank_bilancia2019", "mechanism.legs=3", "one of 3 equal legs is drawn"),
        ("vcfm_folded", "mechanism.bistable.half_beams=4", "one half of the eight folded beams is drawn"),
        ("vcfm_ding2022", "mechanism.bistable.half_beams=3", "4 instead of 3"),
    ],
)
def test_export_says_how_often_a_part_is_to_be_made(cli, config, change, reported):
    spec = str(CONFIGS[0].parent / f"{config}.yaml")
    assert reported in cli("export", spec, "--set", change).out
    assert reported in cli("export", spec, "--set", change, "--json").document["notes"][0]


def test_export_gives_the_same_geometry_as_design(cli, cam):
    cli("design", cam, "-o", "one", "--no-plots")
    cli("export", "one/design.yaml", "-o", "two")
    designed = {path.name: path.read_bytes() for path in (cli.folder / "one/geometry").iterdir()}
    assert {"cam.dxf", "cam.svg"} <= set(designed)
    assert {name: (cli.folder / "two" / name).read_bytes() for name in designed} == designed


def test_kerf_adds_a_second_file_and_leaves_the_first(cli, cam):
    cli("export", cam, "-o", "one")
    assert cli("export", cam, "-o", "two", "--kerf", "0.2 mm").code == 0
    assert (cli.folder / "one/cam.dxf").read_bytes() == (cli.folder / "two/cam.dxf").read_bytes()
    assert (cli.folder / "two/cam-kerf.dxf").read_bytes() != (cli.folder / "two/cam.dxf").read_bytes()


def test_a_coarser_tolerance_gives_a_smaller_file(cli, cam):
    cli("export", cam, "-o", "one")
    cli("export", cam, "-o", "two", "--tolerance", "0.1 mm")
    assert (cli.folder / "two/cam.dxf").stat().st_size < (cli.folder / "one/cam.dxf").stat().st_size


@pytest.mark.parametrize(
    ("option", "value", "code"),
    [
        ("--kerf", "0.2", 2),
        ("--kerf", "1 N", 2),
        ("--kerf", "-1 mm", 2),
        ("--tolerance", "0 mm", 2),
        ("--kerf", "9 m", 3),
    ],
)
def test_a_kerf_or_tolerance_that_makes_no_sense_is_refused(cli, cam, option, value, code):
    done = cli("export", cam, option, value)
    assert done.code == code
    assert len(done.err.splitlines()) == 1
    assert not (cli.folder / "cfm-out").exists()


def completed(cli, words):
    """Return what bash is told to complete the last of some words with."""
    typed = {"_CFMKIT_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    return set(cli(**typed).out.split())


def test_a_shell_completes_verbs_families_topics_and_leaves_files_to_itself(cli, cam):
    assert completed(cli, "cfmkit sw") == {"sweep"}
    assert completed(cli, "cfmkit new ") == set(families.names())
    assert completed(cli, "cfmkit schema v") == {"vcfm"}
    assert {"materials", "metrics"} < completed(cli, "cfmkit show m")
    assert completed(cli, "cfmkit show force_rip") == {"force_ripple"}
    assert completed(cli, "cfmkit analyze ") == set()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_typer_completes_in_the_shell(cli, shell):
    assert {"--install-completion", "--show-completion"} <= set(cli("--help").out.split())
    script = cli(**{"_CFMKIT_COMPLETE": f"source_{shell}"})
    assert (script.code, "_CFMKIT_COMPLETE" in script.out) == (0, True)


def test_a_value_of_the_spec_that_is_given_as_an_option_is_answered_with_set(cli, cam):
    done = cli("design", cam, "--force", "60 N")
    assert done.code == 2
    assert (
        "No such option: --force; values of the spec are changed with --set, e.g. --set design.force='60 N'" in done.err
    )


def test_a_misspelt_part_of_a_name_is_answered_with_that_part(cli):
    assert "did you mean 'safety'?" in cli("show", "safty").err


def test_an_example_of_a_folder_is_found_by_its_own_name(cli):
    assert cli("examples", "cam_tolerance", "--no-schema").code == 0
    assert (cli.folder / "cam_tolerance.yaml").is_file()


def test_a_shell_without_completion_is_refused(cli, monkeypatch):
    monkeypatch.setattr("typer._completion_shared._get_shell_name", lambda: "tcsh")
    monkeypatch.setattr("typer.completion._get_shell_name", lambda: "tcsh")
    done = cli("--show-completion")
    assert done.code == 2
    assert "bash, zsh, fish and PowerShell" in done.err


def test_faults_are_shown_with_their_line_and_a_caret_where_v_asks_for_it(cli):
    (cli.folder / "one.yaml").write_text("family: cam\nmechanism:\n  roller_radius: 16 kg\n")
    plain, verbose = cli("check", "one.yaml").err.splitlines(), cli("check", "-v", "one.yaml").err.splitlines()
    assert all(line.startswith("one.yaml:") for line in plain)
    assert [line for line in verbose if line.startswith("one.yaml:")] == plain
    at = next(number for number, line in enumerate(verbose) if "16 kg' is a mass" in line)
    assert verbose[at + 1 : at + 3] == ["    3 |   roller_radius: 16 kg", "      |                  ^"]
