"""`clean` removes what a manifest or a journal proves to be of a run, and nothing else."""

import os
from pathlib import Path

import pytest

from cfmkit.errors import FolderInUse, OutputError
from cfmkit.runs.remove_files_that_runs_wrote import remains_below, remains_in, remove
from cfmkit.store import RunFolder
from cfmkit.store.file_names_and_overwrite_checks import JOURNAL
from cfmkit.store.lock import LOCK
from cfmkit.studies.journal import Journal


def a_run(path, *names):
    with RunFolder(path) as folder:
        for name in names or ("curve.csv", "figures/loop.png"):
            folder.write(name, name.encode())
        with Journal(folder.journal) as journal:
            journal.add("0" * 32, 1)
        folder.commit({})


def left(root):
    return sorted(str(path.relative_to(root)) for path in root.rglob("*") if path.is_file() or path.is_symlink())


def clean(root):
    for one in sorted(remains_below(root), key=lambda one: len(one.folder.parts), reverse=True):
        remove(one, root)


def test_what_a_run_wrote_goes_with_its_folders(tmp_path):
    a_run(tmp_path / "out" / "one", "curve.csv", "figures/loop.png")
    a_run(tmp_path / "out" / "one" / "inner")
    found = {str(one.folder.relative_to(tmp_path)): set(one.files) for one in remains_below(tmp_path)}
    every = {"curve.csv", "figures/loop.png", JOURNAL, "manifest.json"}
    assert found == {"out/one": every, "out/one/inner": every}
    clean(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_proven_stays(tmp_path):
    root = tmp_path / "out"
    a_run(root, "curve.csv", "metrics.json", "figures/a.png")
    (root / "metrics.json").write_text("edited")
    (root / "notes.txt").write_text("mine")
    (root / "figures" / "mine.png").write_text("mine")
    (root / "figures" / "a.png").unlink()
    (root / "figures" / "a.png").symlink_to(root / "notes.txt")
    elsewhere = tmp_path / "elsewhere"
    a_run(elsewhere)
    (root / "link").symlink_to(elsewhere)
    [one] = remains_below(root)
    assert (set(one.files), set(one.edited)) == (
        {"curve.csv", JOURNAL, "manifest.json"},
        {"metrics.json", "figures/a.png"},
    )
    clean(root)
    assert left(root) == ["figures/a.png", "figures/mine.png", "link", "metrics.json", "notes.txt"]
    assert len(left(elsewhere)) == 4


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("manifest.json", b'{"files": {"../precious": {}}, "cfmkit": "0"}'),
        ("manifest.json", b'{"name": "an app", "version": "1"}'),
        (JOURNAL, b'{"c":"00000000","k":"0"}\n'),
        (JOURNAL, b""),
    ],
)
def test_files_that_only_have_our_names_stay(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert list(remains_below(tmp_path)) == []


def test_the_journal_of_a_killed_run_goes(tmp_path):
    with Journal(tmp_path / JOURNAL) as journal:
        journal.add("0" * 32, 1)
    with (tmp_path / JOURNAL).open("ab") as file:
        file.write(b'{"c":"torn')
    assert remains_in(tmp_path).files == (JOURNAL,)
    remove(remains_in(tmp_path), tmp_path)
    assert left(tmp_path) == []


@pytest.mark.parametrize("line", [b"my own notes\n", b"{}\n", b"\n", b"no end"])
def test_a_journal_to_which_somebody_else_wrote_stays(tmp_path, line):
    a_run(tmp_path)
    with (tmp_path / JOURNAL).open("ab") as file:
        file.write(line)
    found = remove(remains_in(tmp_path), tmp_path)
    assert (JOURNAL in found.files, found.edited) == (False, (JOURNAL,))
    assert (tmp_path / JOURNAL).read_bytes().endswith(line)


@pytest.mark.parametrize("damage", [lambda text: text[:40] + b"?" + text[41:], lambda text: text + bytes(64)])
def test_a_damaged_journal_goes_all_the_same(tmp_path, damage):
    with Journal(tmp_path / JOURNAL) as journal:
        journal.add("0" * 32, 1)
        journal.add("1" * 32, 2)
    (tmp_path / JOURNAL).write_bytes(damage((tmp_path / JOURNAL).read_bytes()))
    assert remains_in(tmp_path).files == (JOURNAL,)


def test_where_a_run_is_at_work_nothing_is_removed(tmp_path):
    a_run(tmp_path)
    found = remains_in(tmp_path)
    with RunFolder(tmp_path), pytest.raises(FolderInUse):
        remove(found, tmp_path)
    assert len(left(tmp_path)) == 4


def test_what_was_edited_while_the_user_was_asked_stays(tmp_path):
    a_run(tmp_path)
    found = remains_in(tmp_path)
    (tmp_path / "curve.csv").write_text("edited")
    assert "curve.csv" not in remove(found, tmp_path).files
    assert left(tmp_path) == ["curve.csv"]


def test_a_run_that_wrote_while_the_user_was_asked_keeps_its_files(tmp_path):
    (tmp_path / "out").mkdir()
    found = remains_in(tmp_path / "out")
    a_run(tmp_path / "out")
    there = left(tmp_path / "out")
    with pytest.raises(OutputError, match="a run wrote there after its files were listed"):
        remove(found, tmp_path)
    assert left(tmp_path / "out") == there


def test_a_kill_while_cleaning_leaves_a_manifest_that_lists_what_is_left(tmp_path, monkeypatch):
    a_run(tmp_path)
    unlink, gone = os.unlink, []

    def dying(path, **more):
        if str(path).startswith(str(tmp_path)) and not Path(path).name.startswith(".cfmkit.lock"):
            gone.append(path)
            if len(gone) > 1:
                raise KeyboardInterrupt
        unlink(path, **more)

    monkeypatch.setattr("cfmkit.store.safe_disk_changes.system.unlink", dying)
    with pytest.raises(KeyboardInterrupt):
        remove(remains_in(tmp_path), tmp_path)
    monkeypatch.undo()
    clean(tmp_path)
    assert left(tmp_path) == []


@pytest.mark.parametrize("names", [(LOCK,), (LOCK, JOURNAL)])
def test_what_a_run_leaves_that_is_killed_before_its_first_record_goes(tmp_path, names):
    folder = tmp_path / "out"
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes(b"4711 host\n" if name == LOCK else b"")
    assert set(remains_in(folder).files) == set(names)
    assert set(remove(remains_in(folder), tmp_path).files) == set(names)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"mine\n", b"4711 host\nand more\n"])
def test_a_lock_file_that_no_run_has_signed_proves_nothing(tmp_path, content):
    (tmp_path / LOCK).write_bytes(content)
    (tmp_path / JOURNAL).write_bytes(b"")
    assert remains_in(tmp_path).files == ()


def test_to_look_at_a_folder_leaves_the_lock_of_this_process_alone(tmp_path):
    a_run(tmp_path)
    before = remains_in(tmp_path)
    with RunFolder(tmp_path) as folder:
        assert LOCK in remains_in(tmp_path).files
        folder.write("curve.csv", b"again")
        folder.commit({})
    assert LOCK not in remove(before, tmp_path).files
