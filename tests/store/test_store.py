"""A run replaces the files of the run before, keeps what a user edited, and leaves the rest alone."""

import hashlib
import json
import subprocess
import sys
from datetime import datetime

import numpy as np
import pytest
from store_support import INFO, listing, one_line, run

from cfmkit.errors import CfmError, OutputError
from cfmkit.store import Manifest, RunFolder, file_hash

# ---- a run


def test_a_run_writes_its_files_and_a_manifest_and_nothing_else(tmp_path):
    run(tmp_path / "deep" / "out", curve_csv=b"a\n1\n", figures__loop_png=b"png")
    assert listing(tmp_path / "deep" / "out") == ["curve.csv", "figures", "figures/loop.png", "manifest.json"]


def test_the_manifest_lists_names_sizes_hashes_versions_and_times(tmp_path):
    run(tmp_path, curve_csv=b"a\n1\n")
    text = (tmp_path / "manifest.json").read_text()
    data = json.loads(text)
    assert data["files"].keys() == {"curve.csv"}
    assert data["files"]["curve.csv"]["bytes"] == 4
    assert data["files"]["curve.csv"]["sha256"] == hashlib.sha256(b"a\n1\n").hexdigest()
    assert INFO.items() <= data.items()
    assert data["versions"]["python"] == sys.version.split()[0]
    assert data["versions"]["numpy"] == np.__version__
    assert 0 <= data["duration_s"] < 60
    assert datetime.fromisoformat(data["started"]) <= datetime.fromisoformat(data["finished"])
    assert data["started"].endswith("Z")
    assert text == json.dumps(data, indent=2, sort_keys=True) + "\n"


def test_only_imported_libraries_are_in_the_manifest(tmp_path):
    code = (
        "from cfmkit.store import RunFolder\n"
        f"with RunFolder({str(tmp_path)!r}) as folder: print(sorted(folder.commit({{}}).data['versions']))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.strip() == "['python']"


def test_nothing_is_written_before_commit_and_nothing_stays_without_it(tmp_path):
    out = tmp_path / "a" / "out"
    with RunFolder(out) as folder:
        folder.write("curve.csv", b"x")
        assert not (out / "curve.csv").exists()
    assert listing(tmp_path) == []


def test_an_exception_leaves_the_old_files(tmp_path):
    run(tmp_path, curve_csv=b"old")
    before = (tmp_path / "manifest.json").read_bytes()

    def interrupted():
        with RunFolder(tmp_path) as folder:
            folder.write("curve.csv", b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (tmp_path / "curve.csv").read_bytes() == b"old"
    assert (tmp_path / "manifest.json").read_bytes() == before
    assert listing(tmp_path) == ["curve.csv", "manifest.json"]


def test_data_may_come_in_pieces(tmp_path):
    with RunFolder(tmp_path) as folder:
        record = folder.write("long.csv", (str(k).encode() + b"\n" for k in range(1000)))
        folder.commit(INFO)
    assert (tmp_path / "long.csv").read_bytes() == b"".join(str(k).encode() + b"\n" for k in range(1000))
    assert record == (3890, file_hash(tmp_path / "long.csv"))


def test_the_last_write_of_a_name_counts(tmp_path):
    with RunFolder(tmp_path) as folder:
        folder.write("a.csv", b"first, and longer")
        folder.write("a.csv", b"second")
        manifest = folder.commit(INFO)
    assert (tmp_path / "a.csv").read_bytes() == b"second"
    assert manifest.files["a.csv"].bytes == 6
    assert Manifest.read(tmp_path).mismatches(tmp_path) == ()


def test_a_run_folder_is_committed_once_and_only_while_open(tmp_path):
    folder = RunFolder(tmp_path)
    with pytest.raises(CfmError, match="not open"):
        folder.write("a", b"")
    with folder:
        folder.commit(INFO)
        with pytest.raises(CfmError, match="committed already"):
            folder.write("a", b"")
    with pytest.raises(CfmError, match="not open"):
        folder.commit(INFO)


@pytest.mark.parametrize(
    ("info", "message"), [({"files": 1}, "files"), ({"a": object()}, "JSON"), ({"a": np.nan}, "JSON")]
)
def test_a_manifest_takes_json_and_not_its_own_keys(tmp_path, info, message):
    with RunFolder(tmp_path) as folder, pytest.raises(CfmError, match=message):
        folder.commit(info)


# ---- what the run before wrote


def test_old_files_that_are_not_written_again_go_and_empty_folders_with_them(tmp_path):
    run(tmp_path, a_csv=b"1", figures__x_png=b"2", figures__deep__y_png=b"3", geometry__z_dxf=b"4")
    (tmp_path / "geometry" / "mine.txt").write_bytes(b"mine")
    run(tmp_path, b_csv=b"5")
    assert listing(tmp_path) == ["b.csv", "geometry", "geometry/mine.txt", "manifest.json"]


def test_files_that_no_run_wrote_are_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_bytes(b"mine")
    run(tmp_path, a_csv=b"1")
    run(tmp_path, a_csv=b"2")
    assert (tmp_path / "notes.txt").read_bytes() == b"mine"
    assert (tmp_path / "a.csv").read_bytes() == b"2"


@pytest.mark.parametrize("early", [True, False])
def test_a_file_that_is_not_ours_in_the_way_is_named_with_the_cure(tmp_path, early):
    (tmp_path / "curve.csv").write_bytes(b"mine")
    with RunFolder(tmp_path) as folder, pytest.raises(OutputError, match="no earlier run wrote") as caught:
        folder.check("other.csv", "curve.csv") if early else folder.write("curve.csv", b"x")
    assert str(tmp_path / "curve.csv") in str(caught.value)
    assert "move it away or give another output folder (--out)" in str(caught.value)
    assert one_line(caught)
    assert listing(tmp_path) == ["curve.csv"]


def test_a_file_that_came_into_the_way_during_the_run_stops_the_commit(tmp_path):
    run(tmp_path, a_csv=b"old")
    with RunFolder(tmp_path) as folder:
        folder.write("a.csv", b"new")
        folder.write("b.csv", b"new")
        (tmp_path / "b.csv").write_bytes(b"mine")
        with pytest.raises(OutputError, match=r"b\.csv is in the way"):
            folder.commit(INFO)
    assert (tmp_path / "a.csv").read_bytes() == b"old"
    assert (tmp_path / "b.csv").read_bytes() == b"mine"


def test_an_edited_file_is_replaced_and_the_edit_is_kept_beside_it(tmp_path):
    run(tmp_path, design_yaml=b"old", figures__x_png=b"old")
    (tmp_path / "design.yaml").write_bytes(b"edited")
    (tmp_path / "figures" / "x.png").write_bytes(b"retouched")
    folder = run(tmp_path, design_yaml=b"new", figures__x_png=b"new")
    assert folder.kept == {"design.yaml": "design.edited.yaml", "figures/x.png": "figures/x.edited.png"}
    assert (tmp_path / "design.yaml").read_bytes() == b"new"
    assert (tmp_path / "design.edited.yaml").read_bytes() == b"edited"
    assert (tmp_path / "figures" / "x.edited.png").read_bytes() == b"retouched"
    assert Manifest.read(tmp_path).files.keys() == {"design.yaml", "figures/x.png"}


def test_each_edit_is_kept_once_under_its_own_name(tmp_path):
    for edit in (b"one", b"two", b"one"):
        run(tmp_path, design_yaml=b"ours")
        (tmp_path / "design.yaml").write_bytes(edit)
    folder = run(tmp_path, design_yaml=b"ours")
    assert folder.kept == {}
    assert listing(tmp_path) == ["design.edited-2.yaml", "design.edited.yaml", "design.yaml", "manifest.json"]
    assert (tmp_path / "design.edited-2.yaml").read_bytes() == b"two"


def test_an_edited_file_that_is_not_written_again_stays_and_is_no_longer_ours(tmp_path):
    run(tmp_path, design_yaml=b"ours")
    (tmp_path / "design.yaml").write_bytes(b"edited")
    run(tmp_path, a_csv=b"1")
    assert (tmp_path / "design.yaml").read_bytes() == b"edited"
    with RunFolder(tmp_path) as folder, pytest.raises(OutputError, match="in the way"):
        folder.check("design.yaml")


def test_an_old_file_that_is_gone_does_not_matter(tmp_path):
    run(tmp_path, a_csv=b"1", b_csv=b"1")
    (tmp_path / "a.csv").unlink()
    (tmp_path / "b.csv").unlink()
    run(tmp_path, a_csv=b"2")
    assert listing(tmp_path) == ["a.csv", "manifest.json"]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b"not json",
        b'{"name": "a web page"}',
        b'{"cfmkit": "1", "files": []}',
        b'{"cfmkit": "1", "files": {"../victim": {"bytes": 1, "sha256": "' + b"0" * 64 + b'"}}}',
        b'{"cfmkit": "1", "files": {"/victim": {"bytes": 1, "sha256": "' + b"0" * 64 + b'"}}}',
        b'{"cfmkit": "1", "files": {"a": {"bytes": 1, "sha256": "short"}}}',
        b'{"cfmkit": "1", "files": {"a": {"bytes": true, "sha256": "' + b"0" * 64 + b'"}}}',
        b"[" * 100_000,
    ],
)
def test_a_manifest_that_is_not_ours_is_in_the_way(tmp_path, content):
    (tmp_path / "manifest.json").write_bytes(content)
    with (
        pytest.raises(OutputError, match=r"manifest\.json is in the way: cfmkit did not write it") as caught,
        RunFolder(tmp_path),
    ):
        pass
    assert one_line(caught)
    assert listing(tmp_path) == ["manifest.json"]
