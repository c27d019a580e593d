"""The list of slow cases names tests that exist."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
LISTED = [line for line in (ROOT / "tests/slow_cases.txt").read_text(encoding="utf-8").splitlines() if line[:1] != "#"]


def test_every_slow_case_is_one_of_a_test_that_exists() -> None:
    tests = {case.partition("[")[0] for case in LISTED}
    assert len(tests) > 50
    for file, *_, name in (test.split("::") for test in sorted(tests)):
        assert re.search(rf"^ *def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE), (file, name)


def test_the_list_is_in_order_and_names_no_case_twice() -> None:
    assert sorted(set(LISTED)) == LISTED
