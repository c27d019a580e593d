"""What a page consists of, and how a terminal prints it."""

from pathlib import Path

import pytest

import cfmkit
from cfmkit.documents import run_document, study_documents
from cfmkit.documents.document import (
    BLANK_LINE,
    CellGrid,
    Document,
    GridColumn,
    JsonText,
    Note,
    PageTable,
    Paragraph,
    Span,
    ValueRow,
    Verbatim,
    WarningEntry,
    Written,
    command_line,
    field,
    record_table,
    shortened_to_clause,
    whole_line,
)
from cfmkit.documents.terminal import page
from cfmkit.documents.terminal import print_blocks as printed_blocks
from cfmkit.errors import ExitCode

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def printed():
    """What a terminal of 40 columns, or as many as are given, prints of blocks."""

    def show(*blocks, width=40):
        return printed_blocks(blocks, width)

    return show


def test_a_paragraph_stands_in_from_its_word_and_cuts_nothing(printed):
    path = "/a/" + 50 * "b"
    assert printed(Paragraph("warning", f"the file {path} is there")) == (
        f"warning    the file\n           {path}\n           is there\n"
    )
    assert printed(Paragraph("first", "")) == "first\n"


def test_a_line_that_is_copied_keeps_its_length(printed):
    assert printed(whole_line("cfmkit analyze ", 60 * "x")) == f"cfmkit analyze {60 * 'x'}\n"


def test_a_table_has_heads_only_where_one_says_something(printed):
    rows = [("a", Span("b"))]
    assert printed(CellGrid((GridColumn(), GridColumn()), rows)) == "a   b\n"
    assert printed(CellGrid((GridColumn(""), GridColumn("raw")), rows)) == "    raw\na   b\n"


def test_cells_are_folded_and_never_cut(printed):
    cell = 30 * "abc"
    assert "".join(printed(CellGrid((GridColumn(),), [(cell,)])).split()) == cell
    assert "\N{HORIZONTAL ELLIPSIS}" not in printed(CellGrid((GridColumn("", False),) * 2, [(cell, cell)]))


def test_records_are_listed_below_their_heading_and_not_at_all_where_there_are_none(printed):
    assert printed(*record_table("units", [{"name": "mm"}], (field("name", ""),))) == "\nunits\n  mm\n"
    assert list(record_table("units", [], (field("name"),))) == []


def test_text_and_data_are_printed_as_they_are(printed):
    assert printed(BLANK_LINE, Verbatim("a  \nb"), JsonText({"c": 1})) == '\na  \nb{\n  "c": 1\n}\n'


def test_of_each_folder_one_file_is_named_on_a_short_page():
    written = Written("out/", ("curve.csv", "geometry/a.dxf", "geometry/b.dxf", "figures/l.png", "manifest.json"))
    assert (written.place, written.names()) == ("out/", ["geometry/{a.dxf,...}", "figures/l.png", "curve.csv"])


def test_a_command_line_is_quoted_for_a_shell_and_stays_on_one_line():
    assert command_line("cfmkit", "new", "a b", "c\nd") == "cfmkit new 'a b' $'c\\x0ad'"


def page_of(document, width=100, everything=False):
    """Return the page of a document as lines."""
    return printed_blocks(page(document, width, everything), width).split("\n")[:-1]


def many(count, **more):
    """Return a document with so many requirements, facts, notes and warnings."""
    text = "the roller of 16 mm is larger than the path's smallest radius of curvature (10.3 mm): it runs on a corner"
    return Document(
        title="a-name",
        summary="20.1 N over 10 mm (2.3 to 12.3 mm)",
        verdict=f"all {count} requirements met",
        headline=(
            *(ValueRow(f"metric {k}", "1.234 %", "<= 5 %", True) for k in range(count)),
            *(ValueRow(f"fact {k}", "12.34 mm (1.2 to 12.3 mm)") for k in range(9)),
        ),
        notes=(Note("yield", "about 14 % of parts would meet the requirements: " + 30 * "word " + "end"),),
        warnings=tuple(
            WarningEntry(f"finding_{k}", text, text, ("--set mechanism.roller_radius=10mm",), ("cfmkit analyze x",))
            for k in range(count)
        ),
        files=Written("cfm-out/a-long-name-of-a-folder-analyze", tuple(f"file{k}.csv" for k in range(12))),
        **more,
    )


@pytest.mark.parametrize("width", [80, 100])
@pytest.mark.parametrize("count", [0, 1, 4, 8, 30])
def test_a_short_page_has_at_most_15_lines_whatever_there_is_to_say(count, width):
    lines = page_of(many(count), width)
    assert len(lines) <= 15
    assert max(map(len, lines)) <= width
    assert lines[0].startswith("a-name   20.1 N over 10 mm")
    assert "cfm-out/a-long-name-of-a-folder-analyze/" in "\n".join(lines)


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_no_word_of_a_page_is_broken(width):
    document = many(3)
    words = set(" ".join(page_of(document, 10_000, everything=True)).split())
    words |= {
        "--set",
        "mechanism.roller_radius=10mm",
        "...",
        "-v:",
        "all",
        "warnings",
        "3",
        "and",
        "2",
        "more",
        "(-v):",
    }
    assert set(" ".join(page_of(document, width)).split()) - words - {f"finding_{k}," for k in range(3)} == set()


def test_requirements_stand_beside_what_else_matters_and_a_remedy_at_the_end_of_its_warning():
    lines = page_of(many(3))
    assert lines[1].split()[:6] == ["metric", "0", "1.234", "%", "<=", "5"]
    assert "fact 0" in lines[1]
    assert [line for line in lines if line.endswith("   --set mechanism.roller_radius=10mm")]


def test_with_v_every_text_warning_and_file_is_there():
    text = " ".join(" ".join(page_of(many(3), everything=True)).split())
    assert "it runs on a corner" in text
    assert "word word end" in text
    assert text.count("cfmkit analyze x") == 3
    assert "file11.csv" in text


def test_why_a_run_has_no_result_is_told_in_full():
    message = "no mechanism meets the targets: " + 20 * "reason " + "end"
    document = Document(title="a", verdict="infeasible", notes=(Note("failed", message, whole=True),))
    assert " ".join(" ".join(page_of(document, 60)).split()).endswith("reason end")


@pytest.mark.parametrize(
    ("text", "limit", "shown"),
    [
        ("short enough", 20, "short enough"),
        ("the first clause ends here (1 mm); the second is long", 40, "the first clause ends here (1 mm)"),
        ("a clause without any: another one has 6.7 % in it, and more", 36, "another one has 6.7 % in it"),
        ("b1 and b2 were turned to fit: b1 -0.85 deg and b2 0.2 deg", 40, "b1 and b2 were turned to fit"),
        ("one very long clause that has no end at all in it", 30, "one very long clause that ..."),
    ],
)
def test_a_warning_is_cut_where_a_clause_ends_and_keeps_its_number(text, limit, shown):
    assert shortened_to_clause(text, limit) == shown


def test_what_a_sweep_does_not_change_has_no_influence_and_ties_are_counted():
    spec = cfmkit.load(CONFIGS / "cam.yaml")
    study = cfmkit.sweep(
        spec, vary={"mechanism.roller_radius": "8 mm:16 mm:3"}, metrics=["force_ripple", "usable_stroke"]
    )
    dimensions = {"force_ripple": "ratio", "usable_stroke": "length"}
    lines = page_of(study_documents.sweep_document(spec, study.summary, dimensions, ExitCode.OK))
    assert any(line.split()[:2] == ["force", "ripple"] and "no influence" in line for line in lines)
    assert any(line.split()[:2] == ["usable", "stroke"] and "no influence" not in line for line in lines)
    assert any("point 1 (3 tie)" in line for line in lines)


def test_a_remedy_costs_a_warning_neither_its_number_nor_its_clause():
    """Before, the number of `undercut` gave way to the remedy on a page of 100 columns."""
    text, remedy = "force not constant over the first 1.14 mm", "design --set design.choose=preload"
    document = Document(title="a", warnings=(WarningEntry("undercut", text, text, (remedy,)),))
    assert page_of(document)[1].endswith(f"undercut: {text}")
    short = Document(title="a", warnings=(WarningEntry("undercut", text, text, ("--set a=1",)),))
    assert page_of(short)[1].endswith("--set a=1")
    assert text in page_of(short)[1]


def test_the_options_of_the_best_point_are_one_line_to_copy_on_a_narrow_page():
    summary = sweep_summary_of_cam()
    lines = page_of(study_documents.sweep_document(cfmkit.load(CONFIGS / "cam.yaml"), summary, {}, ExitCode.OK), 60)
    (best,) = [line for line in lines if "best  " in line]
    assert best.count("--set") == 2
    assert len(best) > 60


def sweep_summary_of_cam():
    """Return the summary of a sweep over two values."""
    vary = {"mechanism.roller_radius": ["8 mm", "10 mm"], "mechanism.rolling_friction": [0.001, 0.002]}
    return cfmkit.sweep(CONFIGS / "cam.yaml", vary=vary, metrics=["force_ripple"]).summary


@pytest.mark.parametrize("width", [80, 100])
def test_names_in_tables_are_whole_and_columns_of_less_weight_give_way(width):
    """Before, `positive.thickness` and `positive.length` were cut to the same letters on a page of 80 columns."""
    names = ("positive.thickness", "positive.length")
    heads = (
        GridColumn("deviation from target over 5 to 235 mm"),
        GridColumn("normalised slope", False),
        GridColumn("gradient", False, 1),
    )
    rows = tuple((name, "-2.85 (-3.16 to -2.55)", "-0.000777 1/mm (-0.00086 to -0.000695)") for name in names)
    lines = page_of(Document(title="a", tables=(PageTable("", heads, rows),)), width)
    assert max(map(len, lines)) <= width
    assert "deviation from target over 5 to 235 mm" in "\n".join(lines)
    assert [line.split()[0] for line in lines[-2:]] == list(names)
    assert ("gradient" in "\n".join(lines)) is (width == 100)


def test_a_short_page_has_the_yield_with_its_remedy_and_the_forces_of_the_test_plan():
    tail = "; linear estimate; with margins: the same command with --set design.process=fdm --set design.yield=90%"
    lines = {
        "yield": f"2 % (fdm, assumed tolerances), 20 % once the modulus is measured: thickness +- 0.05 mm{tail}",
        "test plan": "make the part, displace to 2 mm and 12 mm, and expect 20 N at 2 mm (9 to 28 N) and 20.3 N at "
        "12 mm (9.6 to 28 N): each range holds for 95 % of parts (linear estimate)",
    }
    notes = tuple(run_document.note_of(word, text) for word, text in lines.items())
    first, second = page_of(Document(title="a", notes=notes))[1:]
    assert first.split("   ")[0].strip() == "yield"
    assert "2 % (fdm, assumed tolerances)  " in first
    assert first.endswith("   --set design.process=fdm --set design.yield=90%")
    assert second.endswith("20 N at 2 mm (9 to 28 N) and 20.3 N at 12 mm (9.6 to 28 N)")
    whole = " ".join(" ".join(page_of(Document(title="a", notes=notes), everything=True)).split())
    assert whole.count("design.yield=90%") == 1
