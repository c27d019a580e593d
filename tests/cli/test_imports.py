"""What a command may import: start-up time is a promise, and imports are what it is made of."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from cfmkit.cli.commands import _convert_if_given

CONFIGS = Path(__file__).parents[2] / "configs"
PROBE = """
import sys
from cfmkit.cli.main import main
code = main(sys.argv[1:])
print("\\n".join(sorted({name.partition(".")[0] for name in sys.modules})), file=sys.stderr)
sys.exit(code)
"""


def imported(folder: Path, *arguments: str) -> set[str]:
    """Return the top-level packages that a command has imported when it is done."""
    done = subprocess.run(
        [sys.executable, "-c", PROBE, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


RADII = "mechanism.roller_radius=8 mm:16 mm:3"
FEW = ("--samples", "10", "-j", "1")
DRAWING = {"matplotlib", "PIL"}
CUTTING = {"ezdxf", "shapely"}
NETWORK = {"ssl", "http"}


@pytest.mark.parametrize(
    ("arguments", "forbidden"),
    [
        (("--help",), {"numpy", "pydantic", "pint", "yaml", "scipy"} | DRAWING | CUTTING),
        (("--version",), {"numpy", "pint", "yaml", "scipy", "rich"} | DRAWING | CUTTING),
        (("analyze", "--help"), {"numpy", "pint", "yaml", "scipy"} | DRAWING | CUTTING),
        (("check", str(CONFIGS / "cam.yaml")), {"scipy", "pint"} | DRAWING | CUTTING | NETWORK),
        (("analyze", str(CONFIGS / "cam.yaml"), "--no-plots"), {"scipy", "pint"} | DRAWING | CUTTING),
        (("analyze", str(CONFIGS / "cam.yaml"), "--no-plots", "-q"), {"scipy", "rich"} | DRAWING | CUTTING),
        (("analyze", str(CONFIGS / "cam.yaml"), "--no-plots", "--json"), {"scipy", "rich"} | DRAWING | CUTTING),
        (
            ("design", str(CONFIGS / "cam.yaml"), "--no-plots"),
            DRAWING | NETWORK,
        ),  # scipy.special draws the parts of 'bench'
        (("sweep", str(CONFIGS / "cam.yaml"), "--vary", RADII, "--no-plots"), {"scipy"} | DRAWING | CUTTING),
        (("sensitivity", str(CONFIGS / "studies/cam_tolerance.yaml"), *FEW, "--no-plots"), DRAWING | CUTTING),
        (("batch", str(CONFIGS / "cam.yaml"), "--verb", "analyze", "-j", "1", "--no-plots"), DRAWING | CUTTING),
        (("measure", str(CONFIGS / "synthetic/cam_loop.csv"), "--no-plots"), DRAWING | CUTTING),
        (("new", "cam", "-o", "-"), {"scipy", "pint"} | DRAWING | CUTTING),
        (("schema",), {"scipy", "pint", "rich"} | DRAWING | CUTTING),
        (("show", "cam"), {"scipy", "pint"} | DRAWING | CUTTING),
        (("show", "metrics"), {"scipy", "pint"} | DRAWING | CUTTING),
        (("show", "materials"), {"scipy", "pint"} | DRAWING | CUTTING),
    ],
    ids=lambda value: "-".join(map(str, value)) if isinstance(value, tuple) and len(value) < 3 else None,
)
def test_a_command_does_not_import_what_it_does_not_need(tmp_path, arguments, forbidden):
    assert not imported(tmp_path, *arguments) & forbidden


@pytest.mark.parametrize(
    ("spec", "rooms"),
    [
        ("cam", ("cam.design", "cam.cams_in_rows")),
        ("vcfm_ding2022", ("vcfm.design", "vcfm.model")),
        (
            "slider_crank_li2019",
            ("slider_crank.design", "slider_crank.springs.design", "slider_crank.springs.model"),
        ),
        ("beam_lan2010", ("beam.design", "beam.shaping.design")),
    ],
)
def test_a_check_does_not_import_what_only_designs_and_sweeps_need(tmp_path, spec, rooms):
    code = "import sys; from cfmkit.cli.main import main; main(sys.argv[1:]); print(*sys.modules)"
    command = [sys.executable, "-c", code, "check", str(CONFIGS / f"{spec}.yaml")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert not {f"cfmkit.families.{room}" for room in rooms} & set(done.stdout.split())


@pytest.mark.parametrize(("nargs", "nothing"), [(1, None), (-1, ())])
def test_an_option_that_is_not_given_is_not_converted(nargs, nothing):
    """Typer makes a validator for each option that is converted."""
    option = SimpleNamespace(nargs=nargs, required=False, callback=None, process_value=lambda _ctx, value: [value])
    _convert_if_given(option)
    assert option.process_value(None, None) == nothing
    assert option.process_value(None, "3") == ["3"]


def test_import_cfmkit_imports_nothing_heavy():
    code = "import sys, cfmkit; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numpy", "pydantic", "typer", "yaml", "pint"} & set(done.stdout.split())


def test_help_is_independent_of_the_folder_it_is_asked_in(tmp_path):
    (tmp_path / "numpy.py").write_text("raise RuntimeError('imported from the working folder')")
    command = Path(sys.executable).parent / "cfmkit"
    done = subprocess.run([command, "--help"], cwd=tmp_path, capture_output=True, env=dict(os.environ), check=False)
    assert done.returncode == 0


def test_results_and_their_short_texts_bring_no_numpy():
    """Lists and tables of the command line, completion among them, import results: numpy is half of their time."""
    check = "import sys, cfmkit.results, cfmkit.cli.options; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


_ALONE = """
import os, sys
from cfmkit.cli.main import entry
assert "numpy" not in sys.modules
code = entry()
status = open("/proc/self/status").read() if os.path.exists("/proc/self/status") else "Threads:\\t1"
print(code, os.environ["OPENBLAS_NUM_THREADS"], status.partition("Threads:")[2].split()[0])
"""


@pytest.mark.parametrize("given", [None, "2"])
def test_an_analysis_keeps_numerical_libraries_to_one_thread_unless_told_otherwise(tmp_path, given):
    environment = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    environment |= {} if given is None else {"OPENBLAS_NUM_THREADS": given}
    spec = Path(__file__).parents[2] / "configs" / "slider_crank_li2019.yaml"
    command = [sys.executable, "-c", _ALONE, "analyze", str(spec), "--no-plots", "-q", "-o", str(tmp_path / "out")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    code, threads, running = done.stdout.split()
    assert (code, threads) == ("0", given or "1")
    assert given or running == "1"
