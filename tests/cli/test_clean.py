"""``cfmkit clean`` end to end: it lists, asks, and removes what runs wrote."""

from __future__ import annotations


def left(cli):
    return sorted(str(path.relative_to(cli.folder)) for path in cli.folder.rglob("*") if path.is_file())


def test_clean_lists_asks_and_removes(cli, cam):
    cli("analyze", cam, "--no-plots", "-q")
    cli("sweep", cam, "--vary", "mechanism.roller_radius=[8 mm, 9 mm]", "--no-plots", "-q")
    (cli.folder / "cfm-out" / "notes.txt").write_text("mine")
    before = left(cli)
    for answer in ("n\n", "\n", "what?\n"):
        done = cli("clean", "cfm-out", stdin=answer)
        assert (done.code, left(cli)) == (0, before)
        assert "nothing was removed" in done.out
    assert "cam-analyze/  4 files" in done.out
    assert "remove 9 files in 2 folders" in done.err
    done = cli("clean", "cfm-out", stdin="y\n")
    assert (done.code, left(cli)) == (0, sorted([cam, "cfm-out/notes.txt"]))
    assert cli("clean", "cfm-out", "--yes").out == "nothing here was written by cfmkit\n"


def test_where_nobody_answers_nothing_is_removed(cli, cam):
    cli("analyze", cam, "-o", "out", "--no-plots", "-q")
    before = left(cli)
    done = cli("clean", "out", stdin="")
    assert (done.code, left(cli)) == (2, before)
    assert "use --yes" in done.err


def test_clean_says_as_json_what_it_removed(cli, cam):
    cli("analyze", cam, "-o", "out", "--no-plots", "-q")
    (cli.folder / "out" / "curve.csv").write_text("edited")
    done = cli("clean", ".", "--yes", "--json")
    assert [name.rpartition("/")[2] for name in done.document["edited"]] == ["curve.csv"]
    names = {name.rpartition("/")[2] for name in done.document["removed"]}
    assert names == {"manifest.json", "metrics.json", "resolved.yaml"}
    assert left(cli) == sorted([cam, "out/curve.csv"])


def test_a_folder_that_is_not_there_is_a_usage_error(cli):
    done = cli("clean", "nowhere")
    assert (done.code, done.err) == (2, "error    nowhere: there is no such folder\n")
