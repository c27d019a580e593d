"""``cfmkit examples``: what comes with the package can be listed, copied with its data, and run."""

from __future__ import annotations

import tomllib
from pathlib import Path

import cfmkit

ROOT = Path(__file__).parents[2]


def test_every_config_is_listed_with_its_family_and_a_sentence(cli):
    done = cli("examples", "--json")
    listed = done.document["examples"]
    files = {
        path.relative_to(ROOT / "configs").with_suffix("").as_posix() for path in (ROOT / "configs").rglob("*.yaml")
    }
    assert {one["name"] for one in listed} == files
    assert {one["family"] for one in listed} == {"beam", "cam", "slider-crank", "vcfm"}
    assert all(len(one["about"]) > 20 for one in listed)


def test_every_folder_of_examples_is_named_for_the_wheel():
    folders = {path.parent.relative_to(ROOT / "configs").as_posix() for path in (ROOT / "configs").rglob("*.yaml")}
    folders |= {path.parent.relative_to(ROOT / "configs").as_posix() for path in (ROOT / "configs").rglob("*.csv")}
    named = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    expected = {
        "cfmkit.configs" if folder == "." else f"cfmkit.configs.{folder.replace('/', '.')}" for folder in folders
    }
    assert expected == {name for name in named if name.startswith("cfmkit.configs")}
    script = (ROOT / "setup.py").read_text()
    assert all(f'"{name.removeprefix("cfmkit.configs")}"' in script for name in expected)


def test_an_example_is_copied_with_its_data_and_runs_there(cli):
    done = cli("examples", "cam_as_built")
    assert done.code == 0
    assert (cli.folder / "synthetic/cam_flanks.csv").is_file()
    assert "cfmkit analyze cam_as_built.yaml" in done.out
    assert cli("analyze", "cam_as_built.yaml", "--no-plots").code in (0, 5)


def test_a_copy_replaces_nothing_and_leaves_no_half(cli):
    (cli.folder / "synthetic").mkdir()
    (cli.folder / "synthetic/cam_flanks.csv").write_text("mine")
    done = cli("examples", "cam_as_built")
    assert done.code == 7
    assert "the file exists" in done.err
    assert not (cli.folder / "cam_as_built.yaml").exists()
    assert (cli.folder / "synthetic/cam_flanks.csv").read_text() == "mine"


def test_an_unknown_example_is_one_line_with_the_nearest_name(cli):
    done = cli("examples", "cma")
    assert (done.code, done.err.strip()) == (2, "error    there is no example 'cma'; did you mean 'cam'?")


def test_examples_that_are_run_leave_nothing(cli):
    done = cli("examples", "--run", "vcfm_ding2022", "--json")
    assert done.code == 0
    assert [one["status"] for one in done.document["examples"]] == ["complete"]
    assert list(cli.folder.iterdir()) == []


def test_names_and_options_that_contradict_each_other_are_refused(cli):
    assert cli("examples", "cam", "--run", "cam").code == 2
    assert cli("examples", "--out", "x").code == 2
    assert list(cli.folder.iterdir()) == []


def test_the_same_list_in_python():
    assert cfmkit.examples()[0].path.is_file()


def test_what_an_example_is_ends_with_its_sentence_and_not_at_an_abbreviation():
    about = {one.name: one.about for one in cfmkit.examples()}
    assert about["studies/slider_crank_class_map"].endswith("sec. 4.2, as a map.")
    assert about["slider_crank_li2019_prototype"].endswith("of spring steel.")
    assert about["studies/slider_crank_li2019_fig9"].endswith("positive above 0.0095741.")
    assert not [name for name, text in about.items() if "configs/" in text]


def test_a_copy_of_a_study_names_the_command_that_runs_it_and_the_file_as_it_lies(cli):
    assert "cfmkit sweep vcfm_fig9_theta2.yaml" in cli("examples", "studies/vcfm_fig9_theta2").out
    text = (cli.folder / "vcfm_fig9_theta2.yaml").read_text()
    assert "`cfmkit sweep vcfm_fig9_theta2.yaml`" in text
    assert "cfmkit sensitivity cam_tolerance.yaml" in cli("examples", "studies/cam_tolerance").out
    assert "configs/" not in (cli.folder / "cam_tolerance.yaml").read_text()
    cli("examples", "cam_as_built")
    assert "--data synthetic/cam_loop.csv" in (cli.folder / "cam_as_built.yaml").read_text()


def test_quick_examples_are_run_first_and_can_be_run_alone(cli, monkeypatch):
    from types import SimpleNamespace

    from cfmkit.errors import ExitCode

    ran = []

    def instead(files, *_, **__):
        ran.append([Path(file).stem for file in files])
        entries = tuple(SimpleNamespace(status="complete", code=ExitCode.OK, message="") for _ in files)
        return SimpleNamespace(entries=entries, exit_code=ExitCode.OK)

    monkeypatch.setattr("cfmkit.runs.batch.batch", instead)
    every, quick = cli("examples", "--run", "all"), cli("examples", "--run", "quick")
    searches = {one.name for one in cfmkit.examples() if one.searches}
    assert {"beam_design_arch", "beam_design_lan", "beam_lan_rising"} == searches == set(ran[0][-3:])
    assert ran[1] == ran[0][:-3]
    assert f"{len(ran[1])} examples take some seconds each, the last 3 search for shapes" in every.err
    assert quick.err == ""
