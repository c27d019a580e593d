"""The compiled code: when it is used again and when not."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import numba
import numpy as np
import pytest

from cfmkit.beams import CLAMPED, Beam, Displacement, Network, Node, Section, Taper, gradient, trace
from cfmkit.beams.kernels import dense, entry, kept, predictor
from cfmkit.beams.warming import warm

_count, _solve, _predict = dense.positive_count, dense.lu_solve, predictor._predict


@numba.njit
def count_of(a):  # type: ignore[no-untyped-def]
    return _count(a)


@numba.njit
def solve_with(a, b):  # type: ignore[no-untyped-def]
    return _solve(a, b)


@numba.njit
def foretell(times, past, slopes, natural, t, y):  # type: ignore[no-untyped-def]
    _predict(times, past, slopes, times.shape[0], natural, t, y)


@pytest.mark.parametrize(("natural", "degree"), [(True, 5), (False, 2)])
def test_the_next_point_is_foretold_exactly_where_the_path_is_a_polynomial(natural: bool, degree: int) -> None:
    """Three points with their slopes hold a polynomial of degree 5, without them one of degree 2."""
    course = np.polynomial.Polynomial(np.random.default_rng(0).standard_normal(degree + 1))
    times, found = np.array([1.0, 0.7, 0.2]), np.empty(1)
    foretell(times, course(times)[:, None], course.deriv()(times)[:, None], natural, 1.3, found)
    assert found[0] == pytest.approx(course(1.3), rel=1e-12)


def test_compiled_code_is_kept_under_the_digest_of_all_kernels() -> None:
    trace(*_pulled_beam())
    for door in (entry._real, entry.states, entry.slopes, entry.row_slopes, entry.held_slopes):
        assert entry.digest()[:16] in door.py_func.__qualname__
    assert list(Path(entry._real.stats.cache_path).glob(f"*{entry.digest()[:16]}*.nbi"))


def _pulled_beam() -> tuple[Network, Displacement]:
    beam = Beam("a", "b", Section(2e9, 1e-2, 1e-3))
    nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(0.1, 0.0)}
    return Network(nodes, {"x": beam}), Displacement("b", 0.0, np.array([1e-4]))


def test_a_changed_kernel_file_changes_the_digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path in Path(entry.__file__).parent.glob("*.py"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.setattr(kept, "__file__", str(tmp_path / "kept.py"))
    before = entry.digest()
    with (tmp_path / "chain.py").open("a") as file:
        file.write("# changed\n")
    assert entry.digest() != before


def test_a_first_compilation_is_announced(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(entry, "STAMP", "never-compiled-before")
    mark = Path(entry._real.stats.cache_path) / "beams-never-compiled-b.compiled"
    with caplog.at_level(logging.WARNING):
        entry.announce()
        entry.announce()
    mark.unlink(missing_ok=True)
    assert [record.message for record in caplog.records] == ["compiling the beam engine: once, about half a minute"]


@pytest.mark.parametrize("seed", range(8))
def test_inertia_and_solution_of_random_symmetric_matrices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 14))
    a = rng.standard_normal((n, n))
    a = a + a.T
    a[rng.random((n, n)) < 0.3] = 0.0
    a = np.triu(a) + np.triu(a, 1).T
    if seed % 2:
        np.fill_diagonal(a, 0.0)
    a += 1e-9 * np.eye(n)
    expected = int((np.linalg.eigvalsh(a) > 0).sum())
    assert count_of(a.copy()) == expected
    b = rng.standard_normal((n, 2))
    if np.linalg.cond(a) < 1e8:
        x = b.copy()
        assert solve_with(a.copy(), x)
        np.testing.assert_allclose(a @ x, b, atol=1e-6)


def test_nothing_is_compiled_twice() -> None:
    """A second compilation for another order of an array in memory takes as long as the first."""

    def pulled(x: np.ndarray, tapered: bool) -> Network:
        taper = Taper(np.array([0.0, 1.0]), np.array([x[1], 2 * x[1]]))
        nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(x[0], 0.0), "c": Node(2 * x[0], x[2])}
        other = Section(2e9, 1e-2, taper if tapered else x[1])
        beams = {"x": Beam("a", "b", Section(2e9, 1e-2, x[1])), "y": Beam("b", "c", other)}
        return Network(nodes, beams)

    x = np.array([0.1, 2e-3, 0.01])
    for tapered in (False, True):
        build = partial(pulled, tapered=tapered)
        slopes = gradient(trace(build(x), Displacement("c", 0.0, np.array([1e-4]))), build, x)
        assert np.isfinite(slopes.effort).all()
        assert np.isfinite(slopes.held).all()
        assert np.isfinite(slopes.stress_extremes("y")).all()
    for door in (entry._real, entry.slopes, entry.row_slopes, entry.held_slopes):
        assert len(door.signatures) == 1


_NOWHERE = """
import logging, os, stat, sys
import numba.core.caching as caching
caching.CacheImpl._locator_classes = [caching.UserProvidedCacheLocator]  # neither package nor home is writable
logging.basicConfig(level=logging.INFO, format="%(message)s")
from cfmkit.beams.kernels.compiler import door

@door("0123456789abcdef")
def twice(x):
    return 2.0 * x

@door("0123456789abcdef")
def thrice(x):
    return 3.0 * x

assert (twice(2.0), thrice(2.0)) == (4.0, 6.0)
print(twice.stats.cache_path, sum(twice.stats.cache_hits.values()))
"""


def _without_folders(folder):
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    script = folder / "script.py"
    if not script.exists():  # kept code is of a file at its time
        script.write_text(_NOWHERE)
    command = [sys.executable, str(script)]
    done = subprocess.run(
        command, env=environment | {"TMPDIR": str(folder)}, capture_output=True, text=True, check=True
    )
    kept, hits = done.stdout.split()
    return Path(kept), int(hits), done.stderr


def test_compiled_code_is_kept_in_a_private_folder_where_nothing_else_is_writable(tmp_path):
    kept, hits, told = _without_folders(tmp_path)
    private = tmp_path / f"cfmkit-compiled-{os.getuid()}"
    assert private in kept.parents
    assert private.stat().st_mode & 0o777 == 0o700
    assert hits == 0
    assert told.count("compiled code is kept in") == 1
    again, hits, _ = _without_folders(tmp_path)
    assert (again, hits) == (kept, 1)


@pytest.mark.parametrize("trap", ["writable by others", "a link", "a file"])
def test_code_is_never_loaded_from_a_folder_that_others_could_have_prepared(tmp_path, trap):
    private = tmp_path / f"cfmkit-compiled-{os.getuid()}"
    if trap == "writable by others":
        private.mkdir()
        private.chmod(0o777)
    elif trap == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        private.symlink_to(tmp_path / "elsewhere")
    else:
        private.touch()
    kept, _, _ = _without_folders(tmp_path)
    assert private not in kept.parents
    (other,) = (folder for folder in kept.parents if folder.parent == tmp_path)
    assert other.stat().st_mode & 0o777 == 0o700


def test_without_any_folder_code_is_compiled_and_not_kept(monkeypatch):
    from cfmkit.beams.kernels import compiler

    monkeypatch.setattr(compiler, "private_folder", lambda _name: None)
    monkeypatch.setattr("numba.core.caching.CacheImpl._locator_classes", [])

    @compiler.door("0123456789abcdef")
    def half(x):
        return 0.5 * x

    assert half(3.0) == 1.5
    assert half.stats.cache_path is None


def test_warming_loads_every_part_of_the_compiled_code() -> None:
    parts = list(warm())
    assert len({part.name for part in parts}) == len(parts) == 5
    for door in (entry._real, entry.states, entry.slopes, entry.row_slopes, entry.held_slopes):
        assert len(door.signatures) >= 1
