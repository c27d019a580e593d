"""Imports that take place when what they name is first used."""

from __future__ import annotations

import pickle
import subprocess
import sys
from threading import Thread

import pytest

from cfmkit.errors import UsageError
from cfmkit.families.deferred_imports import deferred_imports, load_deferred
from cfmkit.families.papers import read_papers

with deferred_imports():
    from colorsys import ONE_THIRD as ABSENT_UNTIL_READ
    from colorsys import rgb_to_yiq

    from nowhere_to_be_found import anything


def test_a_module_is_imported_by_the_first_use_of_a_name_of_it():
    """In a process of its own: here something else may have imported it."""
    program = (
        "import sys\nfrom cfmkit.families.deferred_imports import deferred_imports\nwith deferred_imports():\n"
        "    from colorsys import rgb_to_yiq\nassert 'colorsys' not in sys.modules\n"
        "print(rgb_to_yiq(0.0, 0.0, 0.0)[0], 'colorsys' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "0.0 True\n"


def test_it_stands_for_the_function_itself():
    import colorsys

    assert load_deferred(rgb_to_yiq) is colorsys.rgb_to_yiq
    assert load_deferred(ABSENT_UNTIL_READ) == pytest.approx(1.0 / 3.0)
    assert rgb_to_yiq.__module__ != "colorsys"  # what Python asks of every object imports nothing
    assert pickle.loads(pickle.dumps(rgb_to_yiq))(0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)
    assert load_deferred(3) == 3


def test_a_module_that_is_not_there_fails_when_it_is_used():
    with pytest.raises(ModuleNotFoundError, match="nowhere_to_be_found"):
        anything()


def test_other_lines_and_other_threads_import_as_ever():
    with pytest.raises(ImportError, match="from MODULE import NAME"), deferred_imports():
        import antigravity  # noqa: F401
    elsewhere = []

    def work():
        from colorsys import rgb_to_hsv

        elsewhere.append(rgb_to_hsv)

    with deferred_imports():
        thread = Thread(target=work)
        thread.start()
        thread.join()
    import colorsys

    assert elsewhere == [colorsys.rgb_to_hsv]
    assert __import__("colorsys", fromlist=["rgb_to_hsv"]) is colorsys


def test_a_paper_is_read_with_its_accents_left_out():
    text = (
        "@article{A,\n  author = {S{\\'a}nchez-Salinas, Silvia and Lee, Kok-Meng},\n  title = {A {CFM}\n    of two},\n"
        "  journal = {J},\n  volume = {3},\n  pages = {1--2},\n  year = {2022},\n  doi = {10.1/x}\n}\n"
    )
    (paper,) = read_papers(text)
    assert paper.name == "sanchez-salinas-2022"
    assert paper.reference == "S. Sanchez-Salinas, K.-M. Lee, A CFM of two, J 3 (2022) 1-2, doi:10.1/x"
    with pytest.raises(UsageError, match=r"^references\.bib: @article\{A has no year"):
        read_papers(text.replace("year = {2022}", "month = {5}"))
