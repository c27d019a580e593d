"""Lab files as they come: encodings, separators, headers and units; and what is refused, in which words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from experiment_support import csv_text, loop_columns, rows
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.errors import CfmError, DataError, UsageError
from cfmkit.experiment import reading
from cfmkit.experiment.reading import read_recording

TIME, MOTION, FORCE = loop_columns()
COLUMNS = (TIME, MOTION, FORCE)
QUOTED = "".join('"' + line.replace(";", '","') + '"\n' for line in rows(COLUMNS, ";", ",").splitlines())


def read(folder, data, units=None):
    path = folder / "data.csv"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_recording(path, units)


GOOD = {
    "semicolon and decimal comma": "Zeit [s];Weg [mm];Kraft [N]\n" + rows(COLUMNS, ";", ","),
    "comma and point": "Time (s),Extension (mm),Load (N)\n" + rows(COLUMNS, ","),
    "tabs and slash units": "t/s\ts/mm\tF/N\n" + rows(COLUMNS, "\t"),
    "spaces": "Time [s]   Disp [mm]   Force [N]\n" + rows(COLUMNS, "  "),
    "quotes and decimal comma in commas": '"Zeit (s)","Weg (mm)","Kraft (N)"\n' + QUOTED,
    "units in a row of their own": '"Time","Extension","Load"\n"(s)","(mm)","(N)"\n' + rows(COLUMNS, ","),
    "bare units in a row": "t;s;F\ns;mm;N\n" + rows(COLUMNS),
    "junk above": "Prüfung;Müller\nDatum;1.2.2021\n\nt [s];s [mm];F [N]\n" + rows(COLUMNS),
    "a comment sign": "# t [s], s [mm], F [N]\n" + rows(COLUMNS, ","),
    "text below": "t [s];s [mm];F [N]\n" + rows(COLUMNS) + "\nEnd of test\n",
    "an empty last column": "t [s];s [mm];F [N];\n" + rows(COLUMNS, end=";\n"),
    "carriage returns": "t [s];s [mm];F [N]\r\n" + rows(COLUMNS, end="\r\n"),
    "words for units": "Time in s;Travel in mm;Force in N\n" + rows(COLUMNS),
    "another column with a unit of no use": "t [s];s [mm];F [N];T [°C]\n" + rows((*COLUMNS, 20 + 0 * TIME)),
    "a column of text": "t [s];s [mm];F [N];note\n" + rows(COLUMNS, end=";ok\n"),
    "other units": "t [min];s [m];F [kN]\n" + rows((TIME / 60, MOTION / 1e3, FORCE / 1e3), digits=9),
}


@pytest.mark.parametrize("text", GOOD.values(), ids=GOOD)
def test_a_lab_file_gives_its_curve(tmp_path, text):
    found = read(tmp_path, text)
    assert found.kind == "force"
    assert found.motion == pytest.approx(MOTION / 1e3, abs=5e-8)
    assert found.effort == pytest.approx(FORCE, abs=5e-5)
    assert found.time == pytest.approx(TIME, abs=5e-5)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_encodings_are_recognised(tmp_path, encoding):
    text = "Prüfstand;Köln\nÜber [s];Weg [mm];Kraft [N]\n" + rows(COLUMNS, ";", ",")
    found = read(tmp_path, text.encode(encoding))
    assert found.decisions.encoding == encoding
    assert found.decisions.columns["time"] == "Über [s]"


def test_decisions_are_told(tmp_path):
    found = read(tmp_path, "made by hand\nt [s];s [mm];F [N];T [°C]\n" + rows((*COLUMNS, TIME), ";", ","))
    assert found.decisions.lines() == [
        "utf-8, separator semicolon, decimal comma",
        "header in line 2, numbers from line 3, 1 other line skipped",
        "time = t [s], displacement = s [mm], force = F [N]",
        "not used: T",
    ]


def test_units_come_from_the_option_by_name_or_number(tmp_path):
    named = read(tmp_path, csv_text("t;s;F"), "t=s,s=mm,F=N")
    numbered = read(tmp_path, rows(COLUMNS), "1=s,2=mm,3=N")
    assert np.array_equal(named.motion, numbered.motion)
    assert np.array_equal(named.effort, numbered.effort)


def test_angle_and_torque_make_a_torque_curve(tmp_path):
    found = read(tmp_path, "phi [deg];M [N*mm]\n" + rows((MOTION, FORCE)))
    assert found.kind == "torque"
    assert found.motion == pytest.approx(np.radians(MOTION), abs=1e-6)
    assert found.effort == pytest.approx(FORCE / 1e3, abs=1e-6)


def test_of_several_columns_the_usual_name_counts_and_the_option_before_it(tmp_path):
    text = "Weg [mm];Dicke [mm];Kraft [N]\n" + rows((MOTION, 2 * MOTION, FORCE))
    assert read(tmp_path, text).motion.max() == pytest.approx(0.1)
    assert read(tmp_path, text, "Dicke=mm").motion.max() == pytest.approx(0.2)


def at(index, column, text):
    return lambda i, cells: [*cells[:column], text, *cells[column + 1 :]] if i == index else cells


BAD = {
    "empty": ("", "the file is empty"),
    "endless line": ("x," * 200_000, "line 1 has 400000 characters; at most 100000 are read"),
    "endless cell": ('"' + "1" * 200_000 + '";2;3\n' + csv_text(), "line 1 has 200006 characters"),
    "only text": ("no\nnumbers\nhere\n", "no lines below each other with at least two numbers"),
    "binary": (bytes(range(256)) * 20, "is not a text file"),
    "NaN": (csv_text(change=at(5, 2, "NaN")), "line 7: column 'F' [N] holds 'NaN', which is not a number"),
    "gap": (csv_text(change=at(5, 2, "")), "line 7: column 'F' [N] is empty"),
    "overflow sign": (csv_text(change=at(9, 1, "****")), "line 11: column 's' [mm] holds '****'"),
    "infinite": (csv_text(change=at(3, 2, "inf")), "line 5: column 'F' [N] holds 'inf'"),
    "word": (csv_text(change=at(3, 2, "broken")), "line 5: column 'F' [N] holds 'broken'"),
    "missing cell": (
        csv_text(change=lambda i, cells: cells[:2] if i == 4 else cells), "line 6 has 2 cells, the others have 3",
    ),
    "cut off": (csv_text().rstrip("\n").rpartition(";")[0] + "\n", "has 2 cells, the others have 3"),
    "too few points": ("s [mm];F [N]\n0;50\n1;51\n2;50\n", "has 3 points; a curve needs at least 8"),
    "constant force": (csv_text(change=lambda i, cells: [*cells[:2], "50"]), "the force is the same at all 121 points"),
    "no travel": (csv_text(change=lambda i, cells: [cells[0], "3", cells[2]]), "the displacement is the same"),
    "time goes back": (csv_text(change=at(8, 0, "0.1")), "line 10: the time goes back from 0.7 s to 0.1 s"),
    "no units": (
        csv_text("t;s;F"),
        'the header names no units, and they are never guessed; state them with --units "t=...,s=...,F=..."',
    ),
    "no header": (rows(COLUMNS), 'state them with --units "1=...,2=...,3=..."'),
    "force in volts": (
        csv_text("t [s];s [mm];F [V]"), "no column for the force was found among 't' [s], 's' [mm], 'F' [V]",
    ),
    "two displacements": (
        "a [mm];b [mm];F [N]\n" + rows(COLUMNS), "2 columns could be the displacement: 'a' [mm], 'b' [mm]; choose with",
    ),
    "thousands": (
        "s [mm];F [N]\n" + "".join(f"{i},5;1.0{i:02d},25\n" for i in range(20)), "has a thousands separator",
    ),
    "grouped by spaces": (
        "s [mm];F [N]\n" + "".join(f"{i}.5;1 0{i:02d}.25\n" for i in range(20)), "has a thousands separator",
    ),
    "comma twice": (
        "s [mm],F [N]\n" + "".join(f"{i},5,50,{i:02d}\n" for i in range(20)),
        "comma seems to be both separator and decimal",
    ),
    "jumping": (
        "s [mm];F [N]\n" + "".join(f"{i % 2 * 9 + 0.1 * i:.1f};{50 + i}\n" for i in range(20)), "no stroke has at",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("data", "complaint"), BAD.values(), ids=BAD)
def test_bad_data_is_refused_in_one_clear_line(tmp_path, data, complaint):
    from cfmkit.experiment.curves_and_metrics_of_recording import measure_recording

    with pytest.raises(DataError) as caught:
        measure_recording(read(tmp_path, data))
    assert complaint in str(caught.value)
    assert str(caught.value).startswith("data.csv: ")
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("units", ["s", "s=", "=mm", "s=V", "s=mm,s=mm", "s=mm,,F=N"])
def test_malformed_units_options_are_usage_errors(tmp_path, units):
    with pytest.raises(UsageError, match="--units"):
        read(tmp_path, csv_text("t;s;F"), units)


def test_an_option_that_contradicts_the_header_or_names_no_column_is_refused(tmp_path):
    with pytest.raises(DataError, match="the header gives 's' in mm, --units in m"):
        read(tmp_path, csv_text(), "s=m")
    with pytest.raises(DataError, match="there is no column 'F1'; did you mean 'F'"):
        read(tmp_path, csv_text("t;s;F"), "F1=N")


def test_a_missing_file_and_a_folder_are_usage_errors(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(UsageError):
            read_recording(path)


@given(
    data=st.binary(max_size=400)
    | st.text(alphabet="0123456789.,;\t\n \"'eE+-nNaA[]()mKs", max_size=400).map(str.encode)
)
def test_whatever_a_file_holds_it_is_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "fuzz.csv"
    path.write_bytes(data)
    complaint, effort = "", np.zeros(1)
    try:
        effort = read_recording(path, None).effort
    except CfmError as error:
        complaint = str(error)
    assert "\n" not in complaint
    assert np.isfinite(effort).all()


def test_titles_of_remarks_beyond_the_numbers_are_dropped_and_units_beyond_them_are_not(tmp_path):
    """LabVIEW ends its header with a column for comments that stays empty."""
    body = rows(loop_columns())
    (tmp_path / "remark.csv").write_text("t [s];s [mm];F [N];Comment\n" + body)
    assert read_recording(tmp_path / "remark.csv").decisions.columns["force"] == "F [N]"
    (tmp_path / "more.csv").write_text("t [s];s [mm];F [N];T [K]\n" + body)
    with pytest.raises(DataError, match="the header names no units"):
        read_recording(tmp_path / "more.csv")


def test_a_single_column_with_decimal_commas_is_not_taken_for_two(tmp_path):
    (tmp_path / "one.csv").write_text("F [N]\n" + "50,25\n" * 20)
    with pytest.raises(DataError, match="comma seems to be both separator and decimal sign"):
        read_recording(tmp_path / "one.csv")
    (tmp_path / "title.csv").write_text("rig seven\n" + rows((MOTION, FORCE), ","))
    assert len(read_recording(tmp_path / "title.csv", "1=mm,2=N")) == len(MOTION)


def test_a_file_that_does_not_end_is_refused_before_it_fills_the_memory(monkeypatch):
    monkeypatch.setattr(reading, "MAX_FILE_BYTES", 1_000_000)
    with pytest.raises(DataError, match="zero: is larger than 1 MB"):
        read_recording("/dev/zero")


@pytest.mark.parametrize("reason", [OSError(5, "Input/Output Error"), OSError("no Device of this Kind")])
def test_the_name_of_a_file_that_cannot_be_read_keeps_its_capitals(tmp_path, monkeypatch, reason):
    def broken(*_, **__):
        raise reason

    (tmp_path / "MyData.CSV").touch()
    monkeypatch.setattr(Path, "open", broken)
    with pytest.raises(UsageError, match=r"MyData\.CSV cannot be read: (input/output error|no Device of this Kind)"):
        reading._read_bytes(tmp_path / "MyData.CSV")
