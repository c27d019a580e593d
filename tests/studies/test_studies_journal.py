"""The journal: what was acknowledged stays, what is damaged is reported and done again."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from journal_support import damage_a_record

from cfmkit.errors import OutputError
from cfmkit.studies.journal import Journal


def key(number):
    return f"{number:032x}"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.sqlite"


def filled(path, count=5):
    with Journal(path) as journal:
        for number in range(count):
            journal.add(key(number), {"v": [number / 3]})


def test_a_record_comes_back_as_it_was(path):
    filled(path)
    with Journal(path) as journal:
        assert [journal.find(key(n))["v"] for n in range(5)] == [[n / 3] for n in range(5)]
        assert journal.find(key(7)) is None
        assert (len(journal), journal.damaged) == (5, 0)


def test_a_closed_journal_is_one_file_and_an_empty_one_is_none(path):
    filled(path)
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    with Journal(path.with_name("other")):
        pass
    assert [one.name for one in path.parent.iterdir()] == [path.name]


def test_a_run_that_adds_nothing_changes_no_byte(path):
    filled(path)
    before = path.read_bytes()
    with Journal(path) as journal:
        assert journal.find(key(1)) is not None
        journal.keep_only(bytes.fromhex(key(number)) for number in range(5))
    assert path.read_bytes() == before


def test_a_long_record_comes_back_too(path):
    text = "".join(np.random.default_rng(0).choice(list("abcdefgh"), 3_000_000))
    with Journal(path) as journal:
        journal.add(key(1), {"v": text})
        assert journal.read(key(1)) == {"v": text}


def test_numbers_that_json_lacks_come_back_as_they_were(path):
    record = {"found": {"x": [0.1, np.nan], "violation": np.inf, "float": "inf"}, "pair": (-np.inf, np.float64("inf"))}
    expected = {"found": {"x": [0.1, np.nan], "violation": np.inf, "float": "inf"}, "pair": [-np.inf, np.inf]}
    with Journal(path) as journal:
        journal.add(key(1), record)
    with Journal(path) as journal:
        np.testing.assert_equal(journal.find(key(1)), expected)


def test_only_what_was_there_at_the_start_is_found_and_nothing_if_fresh(path):
    filled(path, 1)
    with Journal(path) as journal:
        journal.add(key(1), "new")
        assert (journal.find(key(0)), journal.find(key(1)), journal.read(key(1))) == ({"v": [0.0]}, None, "new")
    with Journal(path, fresh=True) as journal:
        journal.add(key(0), "newer")
        assert (journal.find(key(0)), journal.find(key(1)), journal.read(key(0))) == (None, None, "newer")
    with Journal(path) as journal:
        assert (journal.find(key(0)), journal.find(key(1))) == ("newer", "new")


def test_a_log_that_is_cut_off_anywhere_loses_its_last_records_only(path):
    """As a failing power supply may leave it."""
    logged = path.with_name(path.name + "-wal")
    filled(path, 1)
    with Journal(path) as journal:
        for number in range(1, 5):
            journal.add(key(number), number)
        main, log = path.read_bytes(), logged.read_bytes()
    for cut in range(0, len(log), 997):
        path.write_bytes(main)
        logged.write_bytes(log[:cut])
        with Journal(path) as journal:
            known = [journal.find(key(number)) for number in range(1, 5)]
            count = sum(one is not None for one in known)
            assert known == [1, 2, 3, 4][:count] + [None] * (4 - count)
            assert (journal.find(key(0)), journal.damaged) == ({"v": [0.0]}, 0)


def test_a_damaged_record_is_passed_over_counted_and_said(path, caplog):
    filled(path, 3)
    damage_a_record(path, bytes.fromhex(key(1)))
    with Journal(path) as journal:
        assert journal.find(key(1)) is None
        assert (journal.find(key(2)), journal.damaged) == ({"v": [2 / 3]}, 1)
        journal.add(key(1), "again")
    assert "damaged records that were computed again: 1" in caplog.text
    with Journal(path) as journal:
        assert (journal.find(key(1)), journal.damaged) == ("again", 0)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"\n\x00\xff\xfe\n" + b"[" * 5000 + b"\nhello\n",
        lambda content: content[: len(content) // 2],
        lambda content: content[:4096] + bytes(4096) + content[8192:],
        lambda content: bytes(len(content)),
    ],
    ids=["something else", "half", "zeros within", "zeros"],
)
def test_a_damaged_file_is_begun_anew_and_that_is_said(path, damage, caplog):
    filled(path, 500)
    path.write_bytes(damage(path.read_bytes()))
    with Journal(path) as journal:
        assert (journal.find(key(1)), len(journal)) == (None, 0)
        journal.add(key(1), "again")
    assert "was damaged: everything is computed again" in caplog.text
    with Journal(path) as journal:
        assert journal.find(key(1)) == "again"


def test_a_journal_of_lines_is_not_read_and_goes_and_that_is_said_once(path, caplog):
    older = path.with_suffix(".jsonl")
    older.write_bytes(b'{"c":"00000000","k":"0"}\n')
    for _ in range(2):
        filled(path, 2)
    assert caplog.text.count("earlier version") == 1
    assert not older.exists()


def test_a_link_in_place_of_the_journal_is_refused(path, tmp_path):
    other = tmp_path / "other"
    other.write_text("precious")
    path.symlink_to(other)
    with pytest.raises(OutputError, match=r"cannot open .* it is a link"):
        Journal(path).__enter__()
    assert other.read_text() == "precious"


def test_a_folder_in_place_of_the_journal_is_refused(path):
    path.mkdir()
    with pytest.raises(OutputError, match="cannot open"):
        Journal(path).__enter__()


def test_a_full_disk_is_an_output_error_and_the_records_before_stay(path):
    with Journal(path) as journal:
        journal.add(key(1), 1)
        journal._db.execute("PRAGMA max_page_count=3")
        with pytest.raises(OutputError, match="the disk is full"):
            journal.add(key(2), np.random.default_rng(0).random(3000).tolist())
        assert journal.read(key(1)) == 1
        journal.add(key(3), 3)
    with Journal(path) as journal:
        assert [journal.find(key(n)) for n in (1, 2, 3)] == [1, None, 3]


KILLED = (
    "import sys, os, signal; from pathlib import Path; from cfmkit.studies.journal import Journal\n"
    "with Journal(Path(sys.argv[1])) as journal:\n"
    "    for n in range(100): journal.add(f'{n:032x}', n)\n"
    "    os.kill(os.getpid(), signal.SIGKILL)\n"
)


@pytest.mark.parametrize("locks", ["locks", "no locks"])
def test_what_was_acknowledged_survives_a_kill(path, locks, monkeypatch):
    if locks == "no locks":  # of the file system; the database then runs without any
        monkeypatch.setenv("CFMKIT_NO_LOCK", "1")
    assert subprocess.run([sys.executable, "-c", KILLED, str(path)]).returncode == -9
    with Journal(path) as journal:
        assert [journal.find(key(n)) for n in range(100)] == list(range(100))


def test_a_record_that_somebody_took_away_is_an_output_error(path):
    with Journal(path) as journal, Journal(path) as other:
        journal.add(key(0), 0)
        other.add(key(1), 1)
        journal.keep_only([bytes.fromhex(key(0))])
        assert (journal.read(key(0)), other.read(key(1))) == (0, 1), "of a later writer"
        other.keep_only([])
        with pytest.raises(OutputError, match="it was changed during the run"):
            journal.read(key(0))


def test_each_of_two_writers_reads_its_own_records(path):
    filled(path, 1)
    with Journal(path) as first, Journal(path) as second:
        writers = {number: (first, second)[number % 2] for number in range(1, 9)}
        for number, writer in writers.items():
            writer.add(key(number), {"v": ["x" * number]})
        for number, writer in writers.items():
            assert writer.read(key(number)) == {"v": ["x" * number]}
    with Journal(path) as journal:
        assert (len(journal), journal.damaged) == (9, 0)


def test_the_newest_record_of_a_key_counts(path):
    with Journal(path) as journal:
        journal.add(key(1), "old")
        journal.add(key(1), "new")
    with Journal(path) as journal:
        assert journal.find(key(1)) == "new"


def test_what_another_study_left_is_dropped_and_gives_its_room_back(path):
    filled(path, 2000)
    large = path.stat().st_size
    with Journal(path) as journal:
        journal.keep_only(bytes.fromhex(key(number)) for number in range(10))
    assert path.stat().st_size < large / 5
    with Journal(path) as journal:
        assert (len(journal), journal.find(key(9)), journal.find(key(10))) == (10, {"v": [3.0]}, None)


def test_a_journal_is_kept_where_folders_cannot_be_opened(path, monkeypatch):
    """As on Windows."""
    for name in ("O_DIRECTORY", "O_NOFOLLOW", "pread", "pwrite"):
        monkeypatch.delattr(os, name)
    monkeypatch.delattr(signal, "pthread_sigmask")
    filled(path, 1)
    with Journal(path) as journal:
        assert journal.find(key(0)) == journal.read(key(0)) is not None
