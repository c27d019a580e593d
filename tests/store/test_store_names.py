"""Nothing outside the output folder is ever touched, whatever the names and links."""

import os
import subprocess
import sys

import pytest
from store_support import listing, one_line, run

from cfmkit.errors import OutputError
from cfmkit.store import RunFolder

# ---- names and links


@pytest.mark.parametrize(
    "name",
    [
        "",
        "/etc/passwd",
        "..",
        "../x",
        "a/../../x",
        "a//b",
        "./a",
        "a/",
        "a\x00b",
        "a\nb",
        "a\\b",
        "manifest.json",
        "Manifest.JSON",
        ".cfmkit.lock",
        ".cfmkit-run/new/x",
        "a/.cfmkit-x",
    ],
)
def test_names_that_leave_the_folder_or_belong_to_it_are_refused(tmp_path, name):
    with RunFolder(tmp_path / "out") as folder, pytest.raises(OutputError, match="is not a name for a file") as caught:
        folder.write(name, b"x")
    assert one_line(caught)
    assert listing(tmp_path) == []


def test_links_are_not_followed_out_of_the_folder(tmp_path):
    outside, out = tmp_path / "outside", tmp_path / "out"
    outside.mkdir()
    out.mkdir()
    (outside / "x.png").write_bytes(b"precious")
    (out / "figures").symlink_to(outside)
    (out / "curve.csv").symlink_to(outside / "x.png")
    with RunFolder(out) as folder:
        for name in ("figures/x.png", "figures/new.png", "curve.csv"):
            with pytest.raises(OutputError, match="is in the way: it is a link"):
                folder.write(name, b"x")
    assert listing(outside) == ["x.png"]
    assert (outside / "x.png").read_bytes() == b"precious"


def test_a_folder_of_ours_that_became_a_link_is_not_followed_when_old_files_go(tmp_path):
    run(tmp_path / "out", figures__x_png=b"same")
    (tmp_path / "out" / "figures").rename(tmp_path / "moved")
    (tmp_path / "out" / "figures").symlink_to(tmp_path / "moved")
    run(tmp_path / "out", a_csv=b"1")
    assert (tmp_path / "moved" / "x.png").read_bytes() == b"same"
    assert (tmp_path / "out" / "figures").is_symlink()


def test_an_old_file_that_became_a_link_or_a_folder_is_in_the_way(tmp_path):
    run(tmp_path, a_csv=b"1", b_csv=b"1")
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).unlink()
    (tmp_path / "a.csv").symlink_to(tmp_path / "nowhere")
    (tmp_path / "b.csv").mkdir()
    with RunFolder(tmp_path) as folder:
        with pytest.raises(OutputError, match="a link"):
            folder.write("a.csv", b"2")
        with pytest.raises(OutputError, match="a folder"):
            folder.write("b.csv", b"2")


def test_a_file_where_a_folder_should_be_is_in_the_way(tmp_path):
    (tmp_path / "figures").write_bytes(b"mine")
    with (
        RunFolder(tmp_path) as folder,
        pytest.raises(OutputError, match="figures is in the way: it is a file, not a folder"),
    ):
        folder.write("figures/x.png", b"x")


@pytest.mark.parametrize("name", [".cfmkit.lock", ".cfmkit-run"])
def test_the_hidden_names_are_not_followed_if_they_are_links(tmp_path, name):
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "x").write_bytes(b"precious")
    out = tmp_path / "out"
    out.mkdir()
    (out / name).symlink_to(victim / "x" if name.endswith("lock") else victim)
    with pytest.raises(OutputError), RunFolder(out):
        pass
    assert (victim / "x").read_bytes() == b"precious"


def test_the_folder_itself_may_be_reached_through_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    run(tmp_path / "link", a_csv=b"1")
    assert listing(tmp_path / "real") == ["a.csv", "manifest.json"]
    assert (tmp_path / "link").is_symlink()


@pytest.mark.parametrize("path", ["", "a\0b"])
def test_a_folder_needs_a_name(path):
    with pytest.raises(OutputError, match="is not a name for a folder"):
        RunFolder(path)


def test_a_file_in_the_place_of_the_folder_or_above_it_is_named(tmp_path):
    (tmp_path / "out").write_bytes(b"mine")
    for path in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with (
            pytest.raises(OutputError, match=r"cannot use the folder .*: a part of the path is a file") as caught,
            RunFolder(path),
        ):
            pass
        assert one_line(caught)
    with pytest.raises(OutputError, match="the name is too long"), RunFolder(tmp_path / "new" / ("x" * 300)):
        pass
    assert listing(tmp_path) == ["out"]


def test_a_name_that_is_too_long_is_an_output_error(tmp_path):
    with RunFolder(tmp_path) as folder, pytest.raises(OutputError, match="the name is too long"):
        folder.write("x" * 300, b"x")


# ---- leftovers


def test_temporary_files_of_dead_processes_go_and_those_of_live_ones_stay(tmp_path):
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    dead, alive = tmp_path / f".cfmkit-{process.pid}-0.tmp", tmp_path / f".cfmkit-{os.getppid()}-0.tmp"
    dead.write_bytes(b"")
    alive.write_bytes(b"")
    run(tmp_path, a_csv=b"1")
    assert listing(tmp_path) == [alive.name, "a.csv", "manifest.json"]


@pytest.mark.parametrize(
    "plan",
    [
        b"",
        b"[]",
        b'{"changes": [], "folders": [".."]}',
        b'{"changes": [{"name": "../x", "new": null, "old": null}], "folders": []}',
    ],
)
def test_a_plan_that_is_not_ours_is_not_followed(tmp_path, plan):
    victim = tmp_path / "x"
    victim.write_bytes(b"precious")
    working = tmp_path / "out" / ".cfmkit-run"
    working.mkdir(parents=True)
    (working / "plan.json").write_bytes(plan)
    with pytest.raises(OutputError, match="is not a plan of cfmkit; remove"), RunFolder(tmp_path / "out"):
        pass
    assert victim.read_bytes() == b"precious"
