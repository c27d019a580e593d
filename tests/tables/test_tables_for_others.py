"""Points and curves for pandas, xarray and Parquet: the same numbers, grids as grids, nothing without its package."""

import io
import sys

import numpy as np
import pytest

import cfmkit
from cfmkit.cli import run_command
from cfmkit.errors import UsageError
from cfmkit.tables import Table, TableColumn, read_csv
from cfmkit.tables.table import parquet

VARY = {
    "mechanism.roller_radius": ["8 mm", "10 mm"],
    "mechanism.springs.stiffness": ["0.6 N/mm", "0.7 N/mm", "0.8 N/mm"],
}


@pytest.fixture(scope="module")
def study():
    return cfmkit.sweep("configs/cam.yaml", vary=VARY, metrics=["force_mean"])


def test_a_grid_has_a_dimension_for_each_varied_value(study):
    pytest.importorskip("xarray", reason="needs the extra 'xarray'")
    found = study.to_xarray()
    assert dict(found.sizes) == {"mechanism.roller_radius": 2, "mechanism.springs.stiffness": 3}
    assert found["force_mean"].attrs == {"units": "N"}
    one = found["force_mean"].sel({"mechanism.roller_radius": 10.0, "mechanism.springs.stiffness": 0.7})
    assert float(one) == study.table["force_mean"][4]


def test_drawn_points_stand_along_one_dimension():
    pytest.importorskip("xarray", reason="needs the extra 'xarray'")
    vary = {"mechanism.roller_radius": "8 mm:12 mm", "mechanism.springs.stiffness": "0.6 N/mm:0.8 N/mm"}
    found = cfmkit.sweep("configs/cam.yaml", vary=vary, combine="lhs", samples=5, metrics=["force_mean"]).to_xarray()
    assert dict(found.sizes) == {"point": 5}


def test_a_curve_is_a_dataset_over_its_points():
    pytest.importorskip("xarray", reason="needs the extra 'xarray'")
    result = cfmkit.analyze("configs/cam.yaml")
    found = result.to_xarray()
    assert found["displacement"].attrs["units"] == "mm"
    assert np.allclose(found["force"], result.to_pandas()["force [N]"], equal_nan=True)


def test_parquet_holds_what_the_csv_holds(tmp_path):
    pyarrow = pytest.importorskip("pyarrow.parquet", reason="needs the extra 'table'")
    out = tmp_path / "out"
    command = ["sweep", "configs/cam.yaml", "--vary", "mechanism.roller_radius=8 mm:16 mm:3", "--no-plots"]
    assert run_command([*command, "--table", "csv,parquet", "-j", "1", "-o", str(out), "-q"]) == 0
    table = pyarrow.read_table(out / "results.parquet")
    expected = read_csv((out / "results.csv").read_bytes())
    assert tuple(table.column_names) == expected.headers
    for name in ("force_mean_load [N]", "status"):
        if name in table.column_names:
            assert table[name].to_pylist() == list(expected.columns[expected.headers.index(name)].cells())


def test_a_column_of_numbers_and_words_becomes_texts_and_nothing_stays_nothing():
    pyarrow = pytest.importorskip("pyarrow.parquet", reason="needs the extra 'table'")
    mixed = Table((TableColumn("a", (1, "x", None)), TableColumn("b", np.array([1.0, np.nan, 2.0]), "N")))
    found = pyarrow.read_table(io.BytesIO(parquet(mixed)))
    assert found.to_pydict() == {"a": ["1", "x", None], "b [N]": [1.0, None, 2.0]}


def test_an_unknown_format_or_a_missing_package_is_told_first(tmp_path, monkeypatch, capsys):
    command = [
        "sweep",
        "configs/cam.yaml",
        "--vary",
        "mechanism.roller_radius=8 mm:16 mm:3",
        "-o",
        str(tmp_path / "out"),
    ]
    assert run_command([*command, "--table", "xlsx"]) == 2
    assert "there are csv, parquet" in capsys.readouterr().err
    for name in ("pyarrow", "pandas", "xarray"):
        monkeypatch.setitem(sys.modules, name, None)  # as where it is not installed
    with pytest.raises(UsageError, match=r"pip install pyarrow"):
        parquet(Table(()))
    assert not (tmp_path / "out").exists()
    result = cfmkit.analyze("configs/cam.yaml")
    with pytest.raises(UsageError, match=r"^to_pandas needs pandas: pip install pandas$"):
        result.to_pandas()
    with pytest.raises(UsageError, match=r"^to_xarray needs xarray: pip install xarray$"):
        result.to_xarray()
