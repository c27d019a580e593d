"""Files as makers of test machines and force gauges write them; names and numbers are our own."""

from __future__ import annotations

import re

import numpy as np
import pytest
from experiment_support import loop_columns

from cfmkit.errors import DataError, UsageError
from cfmkit.experiment.reading import read_recording, read_recordings

TIME, MOTION, FORCE = loop_columns()
POINTS = list(zip(TIME, MOTION, FORCE, strict=True))
LBF, KGF, INCH = 4.4482216152605, 9.80665, 25.4


def lines(form: str, scale: float = 1.0, decimal: str = ".", **more) -> str:
    """One line a point: ``{n}``, ``{t}``, ``{s}`` and ``{f}``, the force in other units."""
    rows = zip(TIME, MOTION, FORCE / scale, strict=True)
    found = [form.format(n=n, t=f"{t:.2f}", s=f"{s:.4f}", f=f"{f:.9f}", **more) for n, (t, s, f) in enumerate(rows, 1)]
    return "\n".join(line.replace(".", decimal) for line in found) + "\n"


LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nDate\t2021/02/01\n"
    "***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t121\t121\t\nDate\t2021/02/01\t2021/02/01\t\n"
    "Y_Unit_Label\tmm\tN\t\nX_Dimension\tTime\tTime\t\nX0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.1\t0.1\t\n"
    "***End_of_Header***\t\t\t\nX_Value\tTravel\tLoad\tComment\n"
)

EXPORTS = {
    "Mark-10": 'Reading,"Load [lbF]","Travel [in]","Time [sec.]"\n'
    + "".join(f"{n},{f / LBF:.7f},{s / INCH:.7f},{t:.2f}\n" for n, (t, s, f) in enumerate(POINTS, 1)),
    "Imada": "No.,Force,Unit,Displacement,Unit,Judge\n" + lines("{n},{f},kgf,{s},mm,OK", KGF),
    "Imada, unit before": "No.;Unit;Force;Unit;Travel\n" + lines("{n};N;{f};mm;{s}"),
    "Instron": 'Specimen 1\n\n"Time","Extension","Load"\n"(s)","(mm)","(N)"\n' + lines('"{t}","{s}","{f}"'),
    "Instron, kN": '"Time","Extension","Load"\n"(s)","(mm)","(kN)"\n' + lines('"{t}","{s}","{f}"', 1e3),
    "Zwick": "Probe 1;;\nPrüfer;Müller;\n\nPrüfzeit;Standardweg;Standardkraft\ns;mm;N\n" + lines("{t};{s};{f}", 1, ","),
    "ZwickRoell": '"Prüfzeit";"Standardweg";"Standardkraft"\n"s";"mm";"N"\n' + lines('"{t}";"{s}";"{f}"', 1, ","),
    "Sauter": "Nr.;Kraft;Weg;Uhrzeit\n" + lines("{n};{f} N;{s} mm;12:00:00", 1, ","),
    "Trapezium": '"1 _ 1","1 _ 1","1 _ 1"\n"Time","Force","Stroke"\n"sec","N","mm"\n' + lines('"{t}","{f}","{s}"'),
    "LabVIEW": LVM + lines("{t}\t{s}\t{f}\t"),
    "LabVIEW without X": LVM + lines("\t{s}\t{f}\t"),
    "LabVIEW with a remark": LVM + lines("\t{s}\t{f}\t").replace("\t\n", "\tcomment of the first row\n", 1),
    "units in a line that says so": "Channel;Weg;Kraft\nEinheit;mm;N\nRate;10;10\nName;s;F\n" + lines("{n};{s};{f}"),
    "bars": "| Travel [mm] | Load [N] |\n|---|---|\n" + lines("| {s} | {f} |"),
    "bars, bare": "Travel [mm]|Load [N]\n" + lines("{s}|{f}"),
    "comma before the unit": '"Travel, mm","Load, N"\n' + lines("{s},{f}"),
    "comma before the unit, bare": "Travel, mm, Load, N\n" + lines("{s}, {f}"),
    "colon before the unit": "Travel: mm;Load: N\n" + lines("{s};{f}"),
    "unit behind the name": "Travel mm;Load N\n" + lines("{s};{f}"),
    "a word in brackets": "Travel (upper);Force (compression)\nmm;N\n" + lines("{s};{f}"),
    "unit in the cell": "Travel,Load\n" + lines("{s} mm,{f} N"),
    "unit against the number": "Travel;Load\n" + lines("{s}mm;{f}N"),
    "unit in the cell, tabs": "Travel\tLoad\n" + lines("{s} mm\t{f} lbF", LBF),
    "unit in the cell, spaces": "Travel Load\n" + lines("{s} mm  {f} N"),
    "unit in the cell, no header": lines("{s} mm;{f} N"),
    "cells without a value below": "s [mm];F [N];;\n" + lines("{s};{f};;") + ";;;\n" * 300,
    "cells without a value above": ";;\n;;\ns [mm];F [N]\n" + ";\n;\n" + lines("{s};{f}"),
    "rows of spaces": "s [mm],F [N]\n" + lines("{s},{f}") + "   ,   \n" * 50,
    "decimal comma between spaces": "Weg [mm] Kraft [N]\n" + lines("{s}   {f}", 1, ","),
    "a line that names the separator": "sep=;\ns [mm];F [N]\n" + lines("{s};{f}"),
    "a long preamble of names and values": "".join(f"Setting {k};{k}\n" for k in range(12))
    + "s [mm];F [N]\n"
    + lines("{s};{f}"),
    "sums below": "s [mm];F [N]\n" + lines("{s};{f}") + "\nMean;50.5\nStandard deviation\n",
    "a remark that not every line has": "s [mm];F [N];note\n" + lines("{s};{f}").replace("\n", ";start\n", 1),
    "other spellings": "Travel [Millimeters],Load [Newtons]\n" + lines("{s},{f}"),
    "capitals": "TRAVEL [MM],LOAD [KGF]\n" + lines("{s},{f}", KGF),
    "daN": "s [mm];F [daN]\n" + lines("{s};{f}", 10.0),
    "cN": "s [mm];F [cN]\n" + lines("{s};{f}", 0.01),
    "ozF": "s [mm];F [ozF]\n" + lines("{s};{f}", LBF / 16),
    "gF": "s [mm];F [gF]\n" + lines("{s};{f}", KGF / 1e3),
    "kp": "s [mm];F [kp]\n" + lines("{s};{f}", KGF),
    "micrometres": "s [µm];F [mN]\n" + "".join(f"{1e3 * s:.3f};{1e3 * f:.3f}\n" for _, s, f in POINTS),
}


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
@pytest.mark.parametrize("text", EXPORTS.values(), ids=EXPORTS)
def test_an_export_gives_its_curve(tmp_path, text, encoding):
    (tmp_path / "data.csv").write_bytes(text.encode(encoding))
    found = read_recording(tmp_path / "data.csv")
    assert found.kind == "force"
    assert found.motion == pytest.approx(MOTION / 1e3, abs=5e-8)
    assert found.effort == pytest.approx(FORCE, abs=5e-5)


@pytest.mark.parametrize("minus", "\u2212\u2010\u2011\u2012\u2013\ufe63\uff0d")
def test_every_sign_that_looks_like_a_minus_is_one(tmp_path, minus):
    text = "s [mm];F [N]\n" + lines("{s};-{f}").replace("-", minus)
    (tmp_path / "data.csv").write_text(text, encoding="utf-8")
    assert read_recording(tmp_path / "data.csv").effort == pytest.approx(-FORCE, abs=5e-5)


@pytest.mark.parametrize(
    ("unit", "size"),
    [("N.mm", 1e-3), ("Nmm", 1e-3), ("N·m", 1.0), ("N-cm", 1e-2), ("kgf-cm", KGF / 100), ("lbf.in", LBF * 0.0254),
     ("ozF-in", LBF / 16 * 0.0254), ("in*lbf", LBF * 0.0254)],
)  # fmt: skip
def test_torques_as_gauges_spell_them(tmp_path, unit, size):
    (tmp_path / "data.csv").write_text(f"Angle [Degrees];Torque [{unit}]\n" + lines("{s};{f}", size))
    found = read_recording(tmp_path / "data.csv")
    assert found.kind == "torque"
    assert found.motion == pytest.approx(np.radians(MOTION), abs=1e-6)
    assert found.effort == pytest.approx(FORCE, abs=2e-6 * size + 1e-6)


def test_a_gauge_that_changes_its_range_states_the_unit_of_each_cell(tmp_path):
    cells = [f"{f / KGF:.6f} kgf" if n % 3 else f"{f / KGF * 1e3:.3f} gf" for n, f in enumerate(FORCE)]
    beside = [cell.replace(" ", ";") for cell in cells]
    for header, values in (("s [mm];F", cells), ("s [mm];F;Unit", beside)):
        body = "".join(f"{s:.4f};{value}\n" for s, value in zip(MOTION, values, strict=True))
        (tmp_path / "data.csv").write_text(f"{header}\n{body}")
        assert read_recording(tmp_path / "data.csv").effort == pytest.approx(FORCE, abs=1e-4)


CONTRADICTIONS = {
    "header and line of units": (
        "Travel [mm],Load [N]\n(mm),(kN)\n" + lines("{s},{f}"), None,
        "the header gives 'Load' in N, the line of units in kN",
    ),
    "line of units and --units": ("s;F\nmm;N\n" + lines("{s};{f}"), "F=lbf", "units gives 'F' in N, --units in"),
    "header and cells": ("s [mm];F [N]\n" + lines("{s};{f} gf"), None, "the header gives 'F' in N, the cells in gf"),
    "cells and --units": ("s [mm];F\n" + lines("{s};{f} gf"), "F=N", "the cells give 'F' in gf, --units in N"),
    "column of units and --units": (
        "s;F;Unit;\n" + lines("{s};{f};gf"), "s=mm,F=N", "the cells give 'F' in gf, --units in N",
    ),
    "header and column of units": ("s [mm];F [N];Unit\n" + lines("{s};{f};kgf"), None, "'F' in N, the cells in kgf"),
    "header and one cell": (
        "s [mm];F [N]\n" + lines("{s};{f} N").replace(" N", " kN", 5).replace(" kN", " N", 4), None,
        "line 6: the header gives 'F' in N, the cell in kN",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "units", "complaint"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_units_that_contradict_each_other_are_refused(tmp_path, text, units, complaint):
    (tmp_path / "data.csv").write_text(text)
    with pytest.raises(DataError, match=re.escape(complaint)):
        read_recording(tmp_path / "data.csv", units)


@pytest.mark.parametrize(("shown", "force"), [("kg", "kgf"), ("g", "gf"), ("LB", "lbf"), ("lbs", "lbf"), ("OZ", "ozf")])
def test_a_mass_is_no_force_unless_units_say_so(tmp_path, shown, force):
    size = {"kgf": KGF, "gf": KGF / 1e3, "lbf": LBF, "ozf": LBF / 16}[force]
    (tmp_path / "data.csv").write_text(f"s [mm];F [{shown}]\n" + lines("{s};{f}", size))
    with pytest.raises(DataError, match=re.escape(f"is a mass; if the gauge shows the force of that mass, say so: "
                                                  f'--units "F={force}"')):  # fmt: skip
        read_recording(tmp_path / "data.csv")
    assert read_recording(tmp_path / "data.csv", f"F={force}").effort == pytest.approx(FORCE, abs=5e-5)


def two(header, form, second=1.4):
    """Two specimens, the second with another force."""
    points = list(zip(MOTION, FORCE, strict=True))
    both = (("1", 1.0), ("2", second))
    return header + "".join(form.format(k=k, s=f"{s:.4f}", f=f"{x * f:.4f}") for k, x in both for s, f in points)


SPECIMENS = {
    "numbers": ("Specimen", two("Specimen,s [mm],F [N]\n", "{k},{s},{f}\n"), ("1", "2")),
    "words": ("Probe", two("s [mm];F [N];Probe\n", "{s};{f};P-{k}\n"), ("P-1", "P-2")),
    "numbers with a point": ("Sample", two("Sample,s [mm],F [N]\n", "{k}.0,{s},{f}\n"), ("1.0", "2.0")),
    "merged cells": ("Specimen", two("Specimen;s [mm];F [N]\n", ";{s};{f}\n").replace("\n;0.0000;", "\nA;0.0000;", 1)
        .replace("\n;0.0000;70", "\nB;0.0000;70", 1), ("A", "B")),
    "of the same force": ("Teil", two("Teil;s [mm];F [N]\n", "{k};{s};{f}\n", 1.0), ("1", "2")),
    "tables": ("table", two("", "") + "\n".join(
        f"Specimen {k}\ns [mm];F [N]\n" + "".join(f"{s:.4f};{k * f:.4f}\n" for s, f in zip(MOTION, FORCE, strict=True))
        for k in (1, 2)), ("1", "2")),
}  # fmt: skip


@pytest.mark.parametrize(("column", "text", "values"), SPECIMENS.values(), ids=SPECIMENS)
def test_several_specimens_are_refused_with_the_choices_and_each_can_be_chosen(tmp_path, column, text, values):
    path = tmp_path / "data.csv"
    path.write_text(text)
    for group in (None, column):
        with pytest.raises(DataError) as caught:
            read_recording(path, None, group)
        assert f'--group "{column}={values[0]}" or --group "{column}={values[1]}"' in str(caught.value)
    each = read_recordings(path, None, column)
    assert tuple(each) == values
    for value in values:
        one = read_recording(path, None, f"{column}={value}")
        assert len(one) == len(MOTION)
        assert np.array_equal(one.effort, each[value].effort)
    assert each[values[0]].effort == pytest.approx(FORCE, abs=1e-4)
    with pytest.raises(DataError, match=f'choose|there are --group "{column}={values[0]}"'):
        read_recording(path, None, f"{column}=9")


def test_specimens_that_take_turns_are_told_apart_by_the_name_of_their_column(tmp_path):
    body = "".join(f"{k},{s:.4f},{x * f:.4f}\n" for _, s, f in POINTS for k, x in (("A", 1.0), ("B", 1.4)))
    (tmp_path / "data.csv").write_text("Specimen,s [mm],F [N]\n" + body)
    with pytest.raises(DataError, match='choose --group "Specimen=A" or --group "Specimen=B"'):
        read_recording(tmp_path / "data.csv")
    assert read_recording(tmp_path / "data.csv", None, "Specimen=B").effort == pytest.approx(1.4 * FORCE, abs=1e-4)


def test_all_rows_are_of_one_specimen_if_the_user_says_so(tmp_path):
    (tmp_path / "data.csv").write_text(SPECIMENS["numbers"][1])
    assert len(read_recording(tmp_path / "data.csv", None, "none")) == 2 * len(MOTION)
    with pytest.raises(UsageError, match="--group is empty"):
        read_recording(tmp_path / "data.csv", None, " ")


@pytest.mark.parametrize("name", ["Cycle", "Zyklus", "Segment", "branch", "Direction", "Judge"])
def test_columns_that_tell_parts_of_one_recording_apart_name_no_specimens(tmp_path, name):
    (tmp_path / "data.csv").write_text(two(f"{name},s [mm],F [N]\n", "{k},{s},{f}\n", 1.0))
    assert len(read_recording(tmp_path / "data.csv")) == 2 * len(MOTION)


SIDE_BY_SIDE = {
    "alike": ("Travel;Load;Travel;Load\nmm;N;mm;N\n", ("1=mm,2=N", "3=mm,4=N")),
    "numbered": ("Travel_1 [mm];Load_1 [N];Travel_2 [mm];Load_2 [N]\n",
                 ("Travel_1=mm,Load_1=N", "Travel_2=mm,Load_2=N")),
    "commas": ('"Travel, A [mm]";"Load, A [N]";"Travel, B [mm]";"Load, B [N]"\n', ("1=mm,2=N", "3=mm,4=N")),
}  # fmt: skip


@pytest.mark.parametrize(("header", "options"), SIDE_BY_SIDE.values(), ids=SIDE_BY_SIDE)
@pytest.mark.parametrize("shorter", [0, 20])
def test_specimens_side_by_side_are_refused_with_the_pairs_and_each_can_be_chosen(tmp_path, header, options, shorter):
    count = len(MOTION) - shorter
    body = "".join(
        f"{s:.4f};{f:.4f};{f'{s:.4f};{2 * f:.4f}' if k < count else ';'}\n"
        for k, (s, f) in enumerate(zip(MOTION, FORCE, strict=True))
    )
    path = tmp_path / "data.csv"
    path.write_text(header + body)
    with pytest.raises(DataError) as caught:
        read_recording(path)
    assert f'choose with --units "{options[0]}" or --units "{options[1]}"' in str(caught.value)
    one, other = (read_recording(path, option) for option in options)
    assert one.effort == pytest.approx(FORCE, abs=1e-4)
    assert other.effort == pytest.approx(2 * FORCE[:count], abs=1e-4)


def test_one_displacement_and_two_forces_leave_the_force_to_choose(tmp_path):
    (tmp_path / "data.csv").write_text("s [mm];F1 [N];F2 [N]\n" + lines("{s};{f};{f}"))
    with pytest.raises(DataError, match='choose with --units "F1=N" or --units "F2=N"'):
        read_recording(tmp_path / "data.csv")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("s [mm];F [N]\n" + lines("{s};{f}") + "pause\n1;50\n2;51\n", "line 124: numbers go on here after a text"),
        ("s [mm];F [N]\n1;50\n2;51\npause\n" + lines("{s};{f}"), "line 5: numbers go on here after a text"),
        ("s;F\n" + lines("{s} mm;{f} N").replace(" N", " V", 1), "line 2: column 'F' [N] holds"),
    ],
)
def test_no_number_of_a_table_is_dropped_silently(tmp_path, text, complaint):
    (tmp_path / "data.csv").write_text(text)
    with pytest.raises(DataError, match=re.escape(complaint)):
        read_recording(tmp_path / "data.csv")


def test_two_columns_of_one_name_are_named_by_number(tmp_path):
    (tmp_path / "data.csv").write_text("s;F;F\n" + lines("{s};{f};{f}"))
    with pytest.raises(DataError, match="columns 2 and 3 are both called 'F'; name the one that is meant by number"):
        read_recording(tmp_path / "data.csv", "s=mm,F=N")
