"""Tables hold what they were given, and their CSV gives it back."""

import csv
import io
import math
import pickle
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfmkit.curves import Column, Curve
from cfmkit.errors import CfmError, DataError, UsageError
from cfmkit.tables import Table, TableColumn, border_values, csv_chunks, curve_table, read_csv, to_csv


def curve(n=3, kind="force", label=None, extra=None, branch="load"):
    steps = np.arange(n)
    return Curve(
        steps / 10_000,
        50 + steps / 8,
        np.full(n, branch),
        steps % 2 == 0,
        kind=kind,
        label=label or {},
        extra=extra or {},
    )


def table(**columns):
    return Table(tuple(TableColumn(name, values) for name, values in columns.items()))


# ---- curves -> table


def test_a_curve_becomes_the_columns_of_the_contract_in_border_units():
    stress = Column([1e6, 2.5e6, math.nan], "stress")
    result = curve_table([curve(extra={"max_stress": stress})])
    assert result.headers == ("branch", "displacement [mm]", "force [N]", "stable", "max_stress [MPa]")
    assert to_csv(result).decode().splitlines() == [
        "branch,displacement [mm],force [N],stable,max_stress [MPa]",
        "load,0.0,50.0,true,1.0",
        "load,0.1,50.125,false,2.5",
        "load,0.2,50.25,true,",
    ]


def test_a_curve_of_one_branch_that_is_stable_needs_no_columns_of_them():
    steps = np.arange(3.0)
    short, long = Curve(steps, steps), Curve(steps, steps, np.full(3, "load"), np.ones(3, dtype=bool))
    assert to_csv(curve_table([short])) == to_csv(curve_table([long]))
    assert short.branches == ("load",)
    assert Curve(steps, steps, "unload", False).select_branch("unload").stable.tolist() == [False] * 3


def test_a_torque_curve_has_angle_and_torque():
    result = curve_table([curve(kind="torque")])
    assert result.headers == ("branch", "angle [deg]", "torque [N*mm]", "stable")
    assert result["torque [N*mm]"].tolist() == [50_000.0, 50_125.0, 50_250.0]
    np.testing.assert_allclose(result["angle"], np.rad2deg([0, 1e-4, 2e-4]), rtol=1e-15)


def test_varied_values_lead_and_a_column_missing_from_one_curve_is_empty_there():
    first = curve(2, label={"preload": (0.0041, "length")})
    second = curve(
        1, label={"preload": (0.005, "length")}, extra={"play": Column([0.1], "ratio"), "note": Column(["x"], "text")}
    )
    result = curve_table([first, second])
    assert result.headers[:2] == ("preload [mm]", "branch")
    assert result["preload"].tolist() == [4.1, 4.1, 5.0]
    assert result.as_dict()["play [1]"] == [None, None, 0.1]
    assert result.as_dict()["note"] == [None, None, "x"]


def test_a_ratio_has_unit_1_and_a_text_has_none():
    extra = {"friction": Column([0.5], "ratio"), "contact": Column(["corner"], "text")}
    assert curve_table([curve(1, extra=extra)]).headers[-2:] == ("friction [1]", "contact")


def test_displacements_in_millimetres_are_the_decimals_of_the_grid():
    tenths = np.arange(2400) / 10_000
    grid = Curve(tenths, tenths, np.full(2400, "load"), np.ones(2400, dtype=bool))
    texts = [line.split(",")[1] for line in to_csv(curve_table([grid])).decode().splitlines()[1:]]
    assert texts == [repr(k / 10) for k in range(2400)]


@pytest.mark.parametrize(
    ("dimension", "si", "border"),
    [
        ("length", 0.0041, 4.1),
        ("stress", 1.23e9, 1230.0),
        ("stiffness", 690.0, 0.69),
        ("force", 0.1, 0.1),
        ("time", 3, 3.0),
    ],
)
def test_border_values_are_short_where_the_si_value_is(dimension, si, border):
    assert float(border_values(si, dimension)) == border


def test_no_curve_is_an_empty_table_and_an_empty_curve_has_its_headers():
    assert (curve_table([]).headers, len(curve_table([])), to_csv(curve_table([]))) == ((), 0, b"")
    assert to_csv(curve_table([curve(0)])) == b"branch,displacement [mm],force [N],stable\n"


# ---- Table


def test_values_are_read_only_and_not_shared_with_the_caller():
    given_values = np.array([1.0, 2.0])
    column = TableColumn("force", given_values, "N")
    given_values[0] = 9.0
    assert column.values.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        column.values[0] = 1.0


def test_missing_is_none_whatever_it_was():
    result = table(a=[1.0, None, math.nan], b=["x", "", None], c=[1, None, 2])
    assert result.as_dict() == {"a": [1.0, None, None], "b": ["x", None, None], "c": [1, None, 2]}


def test_numpy_scalars_and_truth_values_become_plain_cells():
    result = table(a=[np.float32(0.5), np.int8(3), np.str_("s"), np.True_, False], b=np.array([True] * 5))
    assert result.as_dict() == {"a": [0.5, 3, "s", "true", "false"], "b": ["true"] * 5}
    assert [type(cell) for cell in result.as_dict()["a"]] == [float, int, str, str, str]


def test_a_table_survives_pickling():
    first = curve_table([curve()])
    assert to_csv(pickle.loads(pickle.dumps(first))) == to_csv(first)


def test_columns_are_found_by_name_and_by_header():
    column = TableColumn("force", [1.0], "N")
    assert Table((column,))["force"] is Table((column,))["force [N]"] is column.values
    with pytest.raises(KeyError, match=r"there is no column 'torque'; there are force \[N\]"):
        Table((column,))["torque"]


@pytest.mark.parametrize("name", ["", " ", "force [N]", "a]", " force", "force "])
def test_a_name_that_would_not_survive_as_a_header_is_refused(name):
    with pytest.raises(CfmError, match="cannot head a column"):
        TableColumn(name, [1.0])


def test_columns_that_do_not_belong_together_are_refused():
    with pytest.raises(CfmError, match=r"one length \(a: 1, b: 2\)"):
        table(a=[1], b=[1, 2])
    with pytest.raises(CfmError, match="two of a"):
        Table((TableColumn("a", [1]), TableColumn("a", [2])))


@pytest.mark.parametrize("value", [1j, [1], object(), b"x"])
def test_what_is_neither_number_nor_text_is_refused(value):
    with pytest.raises(CfmError, match="numbers, texts and None"):
        TableColumn("a", [value])


def test_a_text_under_a_unit_is_refused():
    with pytest.raises(CfmError, match=r"'fast' is not a number: column 'force \[N\]' has a unit"):
        TableColumn("force", [1.0, "fast"], "N")


def test_a_matrix_is_not_a_column():
    with pytest.raises(CfmError, match=r"shape \(2, 2\)"):
        TableColumn("a", np.eye(2))


# ---- CSV


def test_floats_are_shortest_ints_have_no_dot_and_negative_zero_has_no_sign():
    result = table(
        a=[0.1 + 0.2, 1e22, 5e-324, -0.0, 1e16], b=[1, 2, -3, 0, 10**20], c=np.array([-0.0, 1, math.nan, 2, math.inf])
    )
    assert to_csv(result).decode().splitlines()[1:] == [
        "0.30000000000000004,1,0.0",
        "1e+22,2,1.0",
        "5e-324,-3,",
        "0.0,0,2.0",
        "1e+16,100000000000000000000,inf",
    ]


def test_only_cells_that_need_quotes_have_them():
    result = table(a=["plain text", "a,b", 'say "hi"', "two\nlines", "12", " x", "a;b", "\u00e4", "inf"])
    assert to_csv(result).decode() == (
        'a\nplain text\n"a,b"\n"say ""hi"""\n"two\nlines"\n"12"\n x\na;b\n\u00e4\n"inf"\n'
    )


texts = st.text(st.characters(codec="utf-8"), max_size=8)
cells = st.one_of(
    st.none(), st.floats(), st.integers(), texts, st.sampled_from(["1", "-0", "1e5", "nan", "inf", '"', "\r"])
)


@st.composite
def tables(draw):
    count = draw(st.integers(0, 6))
    kinds = st.sampled_from([cells, st.floats(), st.integers(-5, 5), texts])
    columns = []
    for index in range(draw(st.integers(1, 4))):
        values = draw(st.lists(draw(kinds), min_size=count, max_size=count))
        unit = draw(st.sampled_from([None, "mm"])) if all(not isinstance(v, str) for v in values) else None
        columns.append(TableColumn(f"c{index}", values, unit))
    return Table(tuple(columns))


@given(tables())
def test_reading_gives_back_what_was_written(given_table):
    data = to_csv(given_table)
    again = read_csv(data)
    assert again.headers == given_table.headers
    assert again.as_dict() == given_table.as_dict()
    for name in given_table.headers:
        if len(given_table) and any(cell is not None for cell in given_table.as_dict()[name]):
            assert type(again[name]) is type(given_table[name])
    assert to_csv(again) == data


def _seen(cell):
    """Return a cell as other programs have it: texts that they could take for formulas have an apostrophe in front."""
    text = "" if cell is None else str(cell)
    kept = (
        isinstance(cell, str) and re.match(r"'*\s*[=+\-@＝＋－＠]", text) and not re.fullmatch(r"\s*.|-\d.*|-inf", text)
    )
    return f"'{text}" if kept else text


@given(tables())
def test_other_readers_see_the_same_rows(given_table):
    rows = list(csv.reader(io.StringIO(to_csv(given_table).decode(), newline=""), strict=True))
    columns = [[_seen(cell) for cell in column.cells()] for column in given_table.columns]
    assert rows == [list(given_table.headers), *map(list, zip(*columns, strict=True))]


FORMULAS = ["=cmd|' /C calc'!A0", "@SUM(1+1)", "+1+2", "-2+3", " =1+1", "\t=1", "\r=1", "＝1+1", "'=1", '="a",b']


@pytest.mark.parametrize("text", FORMULAS)
def test_no_spreadsheet_takes_a_text_for_a_formula(text):
    data = to_csv(table(name=[text, "plain"], number=[-1.5, 2.0]))
    ((_, (cell, number), _),) = (list(csv.reader(io.StringIO(data.decode(), newline=""), strict=True)),)
    assert (cell, number) == (f"'{text}", "-1.5")
    assert read_csv(data).as_dict()["name"] == [text, "plain"]


@pytest.mark.parametrize("text", ["-", "a=b", "1-2", "force@5mm", "O'Neill", "'quoted'", "-5"])
def test_a_text_that_is_no_formula_stays_as_it_is(text):
    assert next(csv.reader(io.StringIO(to_csv(table(a=[text, "x"])).decode().split("\n", 1)[1]))) == [text]


def test_pandas_reads_numbers_as_numbers():
    pandas = pytest.importorskip("pandas", reason="needs the extra 'xarray'")

    frame = pandas.read_csv(io.BytesIO(to_csv(curve_table([curve()]))))
    assert frame["displacement [mm]"].tolist() == [0.0, 0.1, 0.2]


def test_chunks_join_to_the_whole_and_stay_small():
    long = table(a=np.arange(20_000) / 7, b=[str(k) + "x" for k in range(20_000)])
    chunks = list(csv_chunks(long))
    assert b"".join(chunks) == to_csv(long)
    assert max(map(len, chunks)) < 0.5 * len(to_csv(long))
    assert read_csv(to_csv(long)).as_dict() == long.as_dict()


def test_a_file_name_that_is_not_text_does_not_stop_the_table():
    assert to_csv(table(spec=["caf\udce9.yaml"])) == b"spec\ncaf\\udce9.yaml\n"


def test_a_file_is_read_like_its_bytes_and_its_text(tmp_path):
    data = to_csv(curve_table([curve()]))
    path = tmp_path / "curve.csv"
    path.write_bytes(data)
    assert to_csv(read_csv(path)) == to_csv(read_csv(data)) == to_csv(read_csv(data.decode())) == data


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "CSV: the file is empty"),
        (b"a,b\n1,2", "CSV: the last line is cut off"),
        (b"a,b\n1,2\n3\n", "CSV:3: has 1 cells, but the header has 2"),
        (b"a,b\n1,2\n\n", "CSV:3: has 1 cells, but the header has 2"),
        (b'a,b\n"x\ny",2\n1,"2\n', "CSV:4: a quote or a carriage return is out of place"),
        (b'a,b\n"x\ny",2\n3\n', "CSV:4: has 1 cells, but the header has 2"),
        (b'a\nx"y\n', "CSV:2: a quote or a carriage return is out of place"),
        (b"a\r\n1\r\n", "CSV:1: a quote or a carriage return is out of place"),
        (b"a\n\xff\n", "CSV: byte 3 is not UTF-8"),
        (b"a,a\n1,2\n", "two of a"),
        (b"a [mm],\n1,2\n", "'' is not a header such as 'force [N]'"),
        (b"force[N]\n1\n", "'force[N]' is not a header"),
        (b"force [N]\n1.5\nfast\n", "'fast' is not a number"),
        (b"force [N]\n1.5\nnan\n", "'nan' is not a number"),
        (b"force [N]\n1_000\n", "'1_000' is not a number"),
        (b"force [N]\n.5\n", "'.5' is not a number"),
    ],
)
def test_what_cfmkit_would_not_have_written_is_refused_with_its_place(data, message):
    with pytest.raises(DataError, match=re.escape(message)) as caught:
        read_csv(data)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_a_usage_error(tmp_path):
    with pytest.raises(UsageError, match=r"curve\.csv: cannot be read: no such file"):
        read_csv(tmp_path / "curve.csv")
