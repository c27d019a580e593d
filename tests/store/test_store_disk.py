"""A file is written whole or not at all, and equal content has one hash."""

import errno
import hashlib
import os
import re
import stat
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from store_support import listing, one_line

import cfmkit
from cfmkit.errors import CfmError, OutputError
from cfmkit.store import atomic_write, file_hash, origin, safe_disk_changes, stable_hash
from cfmkit.store.content_hashes_and_versions import tree_hash

# ---- atomic_write


def test_a_file_is_written_whole_and_leaves_no_temporary_file(tmp_path):
    path = tmp_path / "report.xml"
    for data in (b"first", [b"sec", b"ond"], bytearray(b"third")):
        record = atomic_write(path, data)
        assert record == (len(path.read_bytes()), file_hash(path))
    assert listing(tmp_path) == ["report.xml"]


def test_a_new_file_has_the_rights_that_the_user_wants(tmp_path):
    before = os.umask(0o027)
    try:
        atomic_write(tmp_path / "a", b"")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


def test_a_link_stays_a_link_and_its_target_is_replaced(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "link").symlink_to("sub/real")
    atomic_write(tmp_path / "link", b"data")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "sub" / "real").read_bytes() == b"data"


def test_what_is_not_an_ordinary_file_is_never_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, reason in (("pipe", "not an ordinary file"), ("folder", "it is a folder")):
        with pytest.raises(OutputError, match=f"cannot write .*{name}: .*{reason}"):
            atomic_write(tmp_path / name, b"")
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)
    with pytest.raises(OutputError, match="not an ordinary file"):
        atomic_write("/dev/null", b"")
    assert Path("/dev/null").is_char_device()


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing/a", "the folder is not there"),
        ("file/a", "a part of the path is a file, not a folder"),
        ("x" * 300, "the name is too long"),
        ("a\0b", "no NUL character"),
        ("a\nb/c", "the folder is not there"),
    ],
)
def test_a_path_that_cannot_be_written_is_named_with_the_reason(tmp_path, path, reason):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(OutputError, match=reason) as caught:
        atomic_write(f"{tmp_path}/{path}", b"data")
    assert one_line(caught)
    assert listing(tmp_path) == ["file"]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EIO, errno.EDQUOT])
@pytest.mark.parametrize("step", ["open", "write", "fsync", "close", "replace"])
def test_a_failing_step_leaves_the_old_file_and_no_temporary_one(tmp_path, monkeypatch, step, code):
    path = tmp_path / "a"
    path.write_bytes(b"old")

    class Failing:
        def __getattr__(self, name):
            return self.fail if name == step else getattr(os, name)

        def fail(self, *arguments):
            if step == "close":
                os.close(*arguments)
            raise OSError(code, os.strerror(code))

    monkeypatch.setattr(safe_disk_changes, "system", Failing())
    with pytest.raises(OutputError, match=f"cannot write {re.escape(str(path))}: ") as caught:
        atomic_write(path, b"new")
    monkeypatch.undo()
    assert path.read_bytes() == b"old"
    assert listing(tmp_path) == ["a"]
    assert one_line(caught)


def test_a_system_that_writes_a_little_at_a_time_gets_it_all(tmp_path, monkeypatch):
    class Slow:
        def __getattr__(self, name):
            return getattr(os, name)

        def write(self, descriptor, data):
            return os.write(descriptor, data[:3])

    monkeypatch.setattr(safe_disk_changes, "system", Slow())
    assert atomic_write(tmp_path / "a", b"0123456789").bytes == 10
    assert (tmp_path / "a").read_bytes() == b"0123456789"


def test_pieces_that_fail_to_come_leave_nothing(tmp_path):
    def pieces():
        yield b"begun"
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        atomic_write(tmp_path / "a", pieces())
    assert listing(tmp_path) == []


# ---- identity


def test_equal_content_has_one_hash_whatever_its_order_and_containers():
    first = stable_hash({"a": 1, "b": {"x": [1.5, -0.0], "y": None}})
    assert first == stable_hash({"b": {"y": None, "x": (np.float64(1.5), 0.0)}, "a": np.int64(1)})
    assert stable_hash([1.5, 2.5]) == stable_hash(np.array([1.5, 2.5]))


def test_the_hash_is_the_same_in_every_version():
    text = b'{"force":50.0,"name":"caf\\u00e9"}'
    assert stable_hash({"name": "caf\u00e9", "force": 50.0}) == hashlib.sha256(text).hexdigest()


@pytest.mark.parametrize(
    ("one", "other"),
    [(1, 1.0), (1, True), ("1", 1), (None, ""), ([1, [2]], [[1], 2]), ({}, []), (0.1 + 0.2, 0.3), ({"a": None}, {})],
)
def test_different_content_has_different_hashes(one, other):
    assert stable_hash(one) != stable_hash(other)


@pytest.mark.parametrize("value", [np.nan, {"a": [np.inf]}, {1: 2}, {1, 2}, object(), b"x", np.array([1j])])
def test_what_has_no_canonical_text_has_no_hash(value):
    with pytest.raises(CfmError, match="no identity"):
        stable_hash(value)


def test_the_stamp_of_a_package_is_that_of_its_source_files(tmp_path):
    (tmp_path / "part").mkdir()
    (tmp_path / "part" / "a.py").write_text("x = 1\n")
    before = tree_hash(tmp_path)
    (tmp_path / "part" / "__pycache__").mkdir()
    for left in ("part/__pycache__/a.cpython-311.pyc", "part/kernel.so", ".hidden"):
        (tmp_path / left).write_text("left behind")
    assert tree_hash(tmp_path) == before
    (tmp_path / "part" / "a.py").write_text("x = 2\n")
    assert tree_hash(tmp_path) != before


def test_what_computes_is_known_by_content_and_versions():
    found = origin()
    assert found["content"] == tree_hash(Path(cfmkit.__file__).parent)
    assert found["numpy"] == version("numpy")
    assert origin(("no-such-library",))["no-such-library"] == "not installed"


# ---- the module itself


def test_the_store_needs_neither_numpy_nor_anything_else_to_start():
    heavy = {"numpy", "pydantic", "fcntl", "typer", "matplotlib"}
    code = f"import sys, cfmkit.store; print(*{heavy} & sys.modules.keys())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == ""


def test_only_one_module_changes_the_disk():
    """Otherwise the fault tests would miss a step."""
    changing = re.compile(
        r"(?<!safe_disk_changes\.system)\b(?:os\.(?:open|write|replace|rename|link|unlink|remove|mkdir|makedirs|rmdir|fsync|truncate|ftruncate)\b"
        r"|shutil|\.(?:write_bytes|write_text|touch|unlink|mkdir|rmdir|rename|symlink_to|hardlink_to)\()|\bopen\([^)]*[\"'][wax]"
    )
    folder = Path(safe_disk_changes.__file__).parent
    found = [
        f"{path.name}: {line.strip()}"
        for path in folder.glob("*.py")
        for line in path.read_text().splitlines()
        if changing.search(line.replace("safe_disk_changes.system.", "").replace("system.", ""))
    ]
    assert found == []
