"""The journal: what was acknowledged stays, what is damaged is reported and done again."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from cfmkit.errors import OutputError
from cfmkit.studies.journal import Journal


def key(number):
    return f"{number:032x}"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.jsonl"


def recalled(journal, key):
    return journal.read(journal.find(key), key)


def filled(path, count=5):
    with Journal(path) as journal:
        for number in range(count):
            journal.add(key(number), {"v": [number / 3]})


def test_a_record_comes_back_as_it_was(path):
    filled(path)
    with Journal(path) as journal:
        assert [recalled(journal, key(n))["v"] for n in range(5)] == [[n / 3] for n in range(5)]
        assert journal.find(key(7)) == -1
        assert (len(journal), journal.damaged, journal.torn) == (5, 0, False)


def test_a_long_record_comes_back_too(path):
    with Journal(path) as journal:
        place = journal.add(key(1), {"v": "x" * 3_000_000})
        assert len(journal.read(place, key(1))["v"]) == 3_000_000


def test_numbers_that_json_lacks_come_back_as_they_were_from_lines_that_are_json(path):
    record = {"found": {"x": [0.1, np.nan], "violation": np.inf, "float": "inf"}, "pair": (-np.inf, np.float64("inf"))}
    expected = {"found": {"x": [0.1, np.nan], "violation": np.inf, "float": "inf"}, "pair": [-np.inf, np.inf]}
    with Journal(path) as journal:
        journal.add(key(1), record)
    with Journal(path) as journal:
        np.testing.assert_equal(recalled(journal, key(1)), expected)
        assert journal.damaged == 0

    def refused(word):
        raise AssertionError(word)

    json.loads(path.read_bytes(), parse_constant=refused)


def test_keys_that_begin_alike_are_told_apart(path):
    alike = ["a" * 16 + "0" * 16, "a" * 16 + "1" * 16]
    with Journal(path) as journal:
        for one in alike:
            journal.add(one, one)
    with Journal(path) as journal:
        assert [recalled(journal, one) for one in alike] == alike


def test_a_torn_last_line_is_dropped_wherever_it_is_cut(path):
    filled(path, 2)
    whole = path.read_bytes()
    first = whole.index(b"\n") + 1
    for cut in range(first + 1, len(whole)):
        path.write_bytes(whole[:cut])
        with Journal(path) as journal:
            assert (len(journal), journal.torn, journal.damaged) == (1, True, 0)
            journal.add(key(9), 9)
        with Journal(path) as journal:
            assert (len(journal), journal.torn, journal.damaged) == (2, False, 0)


def test_a_damaged_record_is_passed_over_and_counted(path):
    filled(path, 3)
    whole = bytearray(path.read_bytes())
    start = whole.index(b"\n") + 1
    end = whole.index(b"\n", start)
    for place in range(start, end):
        hurt = whole.copy()
        hurt[place] ^= 0x01
        path.write_bytes(hurt)
        with Journal(path) as journal:
            assert journal.damaged == 1
            assert journal.find(key(1)) == -1
            assert recalled(journal, key(2)) == {"v": [2 / 3]}


def test_a_line_of_anything_else_is_damage_not_an_error(path):
    path.write_bytes(b"\n\x00\xff\xfe\n" + b"[" * 5000 + b"\nhello\n")
    with Journal(path) as journal:
        assert (len(journal), journal.damaged) == (0, 4)


def test_a_link_in_place_of_the_journal_is_refused(path, tmp_path):
    other = tmp_path / "other"
    other.write_text("precious")
    path.symlink_to(other)
    with pytest.raises(OutputError, match="cannot open"):
        Journal(path).__enter__()
    assert other.read_text() == "precious"


def test_a_full_disk_is_an_output_error(path, monkeypatch):
    with Journal(path) as journal:
        monkeypatch.setattr(os, "write", lambda *_: (_ for _ in ()).throw(OSError(28, "no space")))
        with pytest.raises(OutputError, match="the disk is full"):
            journal.add(key(1), 1)


def test_what_was_acknowledged_survives_a_kill(path):
    code = (
        "import sys, os, signal; from pathlib import Path; from cfmkit.studies.journal import Journal\n"
        "with Journal(Path(sys.argv[1])) as journal:\n"
        "    for n in range(100): journal.add(f'{n:032x}', n)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", code, str(path)]).returncode == -9
    with Journal(path) as journal:
        assert [recalled(journal, key(n)) for n in range(100)] == list(range(100))


def test_a_record_is_believed_by_its_key_not_by_its_place(path):
    filled(path, 2)
    with Journal(path) as journal, pytest.raises(OutputError, match="it was changed while the study ran"):
        journal.read(journal.find(key(0)), key(1))


def test_each_of_two_writers_reads_its_own_records(path):
    filled(path, 1)
    with Journal(path) as first, Journal(path) as second:
        places = {}
        for number in range(1, 9):
            writer = (first, second)[number % 2]
            places[number] = writer, writer.add(key(number), {"v": ["x" * number]})
        for number, (writer, place) in places.items():
            assert writer.read(place, key(number)) == {"v": ["x" * number]}
    with Journal(path) as journal:
        assert (len(journal), journal.damaged) == (9, 0)


def test_the_newest_record_of_a_key_counts(path):
    with Journal(path) as journal:
        journal.add(key(1), "old")
        journal.add(key(1), "new")
    with Journal(path) as journal:
        assert recalled(journal, key(1)) == "new"
