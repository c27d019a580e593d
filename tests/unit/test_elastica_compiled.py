"""The compiled code: what it is kept as, what is checked before it is used, and that it is what numba makes of it."""

from __future__ import annotations

import copy
import ctypes
import gc
import io
import logging
import os
import pickle
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from cfmkit.elastica import CLAMPED, Beam, Control, Displacement, Network, Node, Section, trace
from cfmkit.elastica.kernels import compiled, dense, disk_cache, machine_code, march, passing_arrays_by_address
from cfmkit.elastica.kernels.compiled import reported
from cfmkit.elastica.kernels.compiler import OPTIONS
from cfmkit.elastica.kernels.passing_arrays_by_address import HEAD, objects
from cfmkit.elastica.kernels.signatures import DOORS
from cfmkit.elastica.warming import warm
from cfmkit.store.private_cache_folder import resolve_trusted

_count, _solve, _swap, _predict = dense.positive_count, dense.lu_solve, dense._swap, march._predict


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


def _pulled_beam() -> tuple[Network, Displacement]:
    beam = Beam("a", "b", Section(2e9, 1e-2, 1e-3))
    nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(0.1, 0.0)}
    return Network(nodes, {"x": beam}), Displacement("b", 0.0, np.array([1e-4]))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where alone code is kept in a test; what the test itself needs is loaded before."""
    trace(*_pulled_beam())
    monkeypatch.setattr(disk_cache, "_lasting", lambda: iter([tmp_path]))
    return tmp_path


CODE = machine_code.Code(("cos",), b"machine\ncode")


def test_code_is_kept_whole_and_for_this_user_alone(folder: Path) -> None:
    assert disk_cache.write("door", CODE) == folder
    assert disk_cache.read("door") == CODE
    (file,) = folder.iterdir()
    assert file.stat().st_mode & 0o022 == 0
    assert disk_cache.stamp()[:24] in file.name


def test_code_that_one_user_compiled_all_can_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "package"
    monkeypatch.setattr(disk_cache, "_lasting", lambda: iter([package]))
    assert disk_cache.write("door", CODE) == package
    assert package.stat().st_mode & 0o777 == 0o755


def test_a_folder_that_cannot_be_looked_into_is_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    disk_cache.write("door", CODE)
    # what others may not enter, to whoever runs the tests: a name too long is refused to the system's owner as well
    monkeypatch.setattr(disk_cache, "_lasting", lambda: iter([Path("/" + 300 * "x"), folder]))
    assert disk_cache.read("door") == CODE


def test_a_changed_kernel_file_changes_the_digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for path in Path(disk_cache.__file__).parent.glob("*.py"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    monkeypatch.setattr(disk_cache, "__file__", str(tmp_path / "disk_cache.py"))
    before = disk_cache.digest()
    for name, same in (("compiled.py", True), ("chain.py", False)):  # the code does not follow from who calls it
        with (tmp_path / name).open("a") as file:
            file.write("# changed\n")
        assert (disk_cache.digest() == before) is same


@pytest.mark.parametrize("changed", ["sources", "python", "numba", "llvmlite", "numpy", "settings", "processor"])
def test_code_of_another_origin_is_not_used(folder: Path, monkeypatch: pytest.MonkeyPatch, changed: str) -> None:
    """Neither under the name that it would have, nor if it were renamed."""
    disk_cache.write("door", CODE)
    (file,) = folder.iterdir()
    origin = disk_cache.origin() | {changed: "another"}
    disk_cache.stamp.cache_clear()
    monkeypatch.setattr(disk_cache, "origin", lambda: origin)
    try:
        assert disk_cache.read("door") is None
        file.rename(folder / f"door-{disk_cache.stamp()[:24]}.code")
        assert disk_cache.read("door") is None
    finally:
        monkeypatch.undo()
        disk_cache.stamp.cache_clear()


@pytest.mark.parametrize(("name", "same"), [("NUMBA_NUM_THREADS", True), ("NUMBA_OPT", False)])
def test_settings_that_change_the_code_count_and_no_others(
    monkeypatch: pytest.MonkeyPatch, name: str, same: bool
) -> None:
    """Processes of one study may have different numbers of threads: they share their code."""
    before = disk_cache.origin()
    monkeypatch.setenv(name, "1")
    disk_cache.origin.cache_clear()
    try:
        assert (disk_cache.origin() == before) is same
    finally:
        monkeypatch.undo()
        disk_cache.origin.cache_clear()


@pytest.mark.parametrize("damage", [lambda data: data[:-1], lambda data: data[:-1] + b"?", lambda _data: b""])
def test_damaged_code_is_not_used(folder: Path, damage: Any) -> None:
    disk_cache.write("door", CODE)
    (file,) = folder.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    assert disk_cache.read("door") is None


@pytest.mark.parametrize("others", ["the folder", "the file", "a folder above"])
def test_code_is_never_used_where_others_could_have_put_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, others: str
) -> None:
    place = tmp_path / "above" / "folder"
    place.mkdir(parents=True)
    monkeypatch.setattr(disk_cache, "_lasting", lambda: iter([place]))
    monkeypatch.setattr(disk_cache, "private_folder", lambda _name, make=True: None)
    disk_cache.write("door", CODE)
    (file,) = place.iterdir()
    assert disk_cache.read("door") == CODE
    {"the folder": place, "the file": file, "a folder above": place.parent}[others].chmod(0o777)
    assert disk_cache.read("door") is None
    if others != "the file":
        assert disk_cache.write("door", CODE) is None


def test_a_file_of_another_user_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    assert resolve_trusted(tmp_path / "file") == tmp_path / "file"
    owner = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    assert bool(resolve_trusted(tmp_path / "file")) == (owner == 0)  # the system's owner may write everywhere anyhow
    assert resolve_trusted(tmp_path / "no such file") is None


class _Swapped:
    """A link that leads to one folder when it is judged and, from then on, to another."""

    def __init__(self, link: Path, judged: Path, then: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        link.symlink_to(judged)
        usual = disk_cache.resolve_trusted

        def judge(path: Path) -> Path | None:
            found = usual(path)
            link.unlink()
            link.symlink_to(then)
            return found

        monkeypatch.setattr(disk_cache, "_lasting", lambda: iter([link]))
        monkeypatch.setattr(disk_cache, "private_folder", lambda _name, make=True: None)
        monkeypatch.setattr(disk_cache, "resolve_trusted", judge)


def test_code_is_read_where_it_was_judged_although_the_link_there_leads_elsewhere_by_then(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged, foreign = folder / "judged", folder / "foreign"
    for place, content in ((judged, b"own"), (foreign, b"foreign")):
        monkeypatch.setattr(disk_cache, "_lasting", lambda place=place: iter([place]))
        disk_cache.write("door", machine_code.Code((), content))
    _Swapped(folder / "link", judged, foreign, monkeypatch)
    code = disk_cache.read("door")
    assert code is not None
    assert code.content == b"own"


def test_code_is_written_where_the_folder_was_judged(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also what the linker makes on its way: who could exchange that would have its code signed."""
    judged, foreign = folder / "judged", folder / "foreign"
    judged.mkdir()
    foreign.mkdir()
    _Swapped(folder / "link", judged, foreign, monkeypatch)
    assert disk_cache.write("door", CODE) == judged
    assert not list(foreign.iterdir())


def test_a_folder_that_becomes_a_link_after_it_was_resolved_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first name on the way is judged as it stands, not what it leads to by then."""
    own, swapped = tmp_path / "own", tmp_path / "swapped"
    own.mkdir()
    swapped.symlink_to(own)
    monkeypatch.setattr(Path, "resolve", lambda self, strict=False: self)
    assert resolve_trusted(own) == own
    assert resolve_trusted(swapped) is None


def test_what_the_linker_would_not_find_is_told_before_it_ends_the_process() -> None:
    with pytest.raises(machine_code.Strange, match="no function no_such_function"):
        machine_code.loaded(machine_code.Code(("no_such_function",), b""))


def test_code_that_cannot_be_loaded_is_compiled_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Two seconds: the smallest door is compiled, once; its first compilation is announced."""
    disk_cache.write("states", machine_code.Code(("no_such_function",), b""))
    with caplog.at_level(logging.WARNING):
        _states_with(compiled._got("states"))
        _states_with(compiled._got("states"))
    said = [record.message for record in caplog.records]
    assert said == ["compiling the beam engine, once: states along beams, a moment"]
    assert len(list(folder.glob("*.code"))) == 1


def test_who_comes_while_another_process_compiles_waits_and_takes_what_that_has_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The code appears while the lock is held: nothing is compiled a second time."""
    assert not list(folder.iterdir())
    from cfmkit.elastica.kernels import build

    code = machine_code.Code((), b"")
    monkeypatch.setattr(build, "compiled", lambda *_all: pytest.fail("compiled although another process did"))
    monkeypatch.setattr(machine_code, "loaded", lambda found: found)
    monkeypatch.setattr(disk_cache, "linked", lambda *_all: None)
    got: list[Any] = []
    waiting = threading.Thread(target=lambda: got.append(compiled._got("slopes")))
    with caplog.at_level(logging.INFO), disk_cache.one_at_a_time("slopes"):
        waiting.start()
        while not caplog.records:
            time.sleep(0.01)
        assert "waiting" in caplog.records[0].message
        disk_cache.write("slopes", code)
    waiting.join(timeout=10.0)
    assert got == [code]


def test_a_process_that_never_ends_does_not_stop_the_others(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "LONGEST_WAIT", 0.2)
    with disk_cache.one_at_a_time("slopes"), disk_cache.one_at_a_time("slopes"):
        assert list(folder.glob("slopes-*.lock"))


def _states_with(call: Any) -> Any:
    """Return the states along a bent beam by a loaded function."""
    network, drive = _pulled_beam()
    path = trace(network, drive, Control(tolerance=1e-4))
    out = np.zeros((len(path), len(path.solver.cut.edges) + path.solver.n_segments, 7))
    given = objects((path.points.y, path.points.drive, out))
    block = HEAD + compiled._whole(path.solver.n_free) + path.solver.model.block + given
    assert call(block, (ctypes.c_int64 * 2)()) == 0
    assert out.any()
    return out


@pytest.fixture(scope="module")
def usual_door() -> Any:
    """The smallest door, compiled in numba's usual way: two seconds."""
    from cfmkit.elastica.kernels import build

    return machine_code.callable_at(build.called("states"))


def test_kept_code_gives_to_the_last_bit_what_numba_gives(usual_door: Any) -> None:
    """One door; all of them: see the slow test below."""
    usual = _states_with(usual_door)
    _states_with(compiled._got("states"))
    code, path = disk_cache.read("states"), disk_cache.library("states")
    assert code is not None
    assert _states_with(machine_code.loaded(code)).tobytes() == usual.tobytes()
    if path is not None:  # there is a C compiler
        assert _states_with(machine_code.in_library(path)).tobytes() == usual.tobytes()


_ONE_DOOR = """
import sys
from cfmkit.elastica.kernels import build
sys.stdout.buffer.write(build.compiled("states").content)
"""


@pytest.mark.usefixtures("usual_door")
def test_code_does_not_follow_from_what_its_process_compiled_before() -> None:
    """Three seconds. Here are the same kernels already, each optimised by itself; in a new process there are none."""
    from cfmkit.elastica.kernels import build

    here = build.compiled("states").content
    alone = subprocess.run([sys.executable, "-P", "-c", _ONE_DOOR], capture_output=True, check=True).stdout
    assert here == alone


_USUAL = """
import sys
import numba
from numba.core.compiler import Compiler
from cfmkit.elastica.kernels import build
from cfmkit.elastica.kernels.compiler import KERNELS, OPTIONS
build._call_type = lambda function, *given: super(numba.types.Function, function).get_call_type(*given)
OPTIONS["pipeline_class"] = Compiler
for each in KERNELS:
    each._compiler.pipeline_class = Compiler
sys.stdout.buffer.write(build.compiled("states").content)
"""


@pytest.mark.usefixtures("usual_door")
def test_what_is_left_out_and_remembered_while_compiling_does_not_change_the_code() -> None:
    """Three seconds. All passes of numba, and every call typed anew; one door, all six were compared by hand."""
    from cfmkit.elastica.kernels import build

    usual = subprocess.run([sys.executable, "-P", "-c", _USUAL], capture_output=True, check=True).stdout
    assert build.compiled("states").content == usual


def test_a_kernel_is_not_compiled_once_more_for_an_argument_that_is_a_constant() -> None:
    from cfmkit.elastica.kernels import build

    @numba.njit(**OPTIONS)
    def clear_both(a):  # type: ignore[no-untyped-def]
        _swap(a, 0, 1)
        for k in range(2):
            _swap(a, k, k)

    with build._drafting():
        clear_both.compile((numba.types.float64[:, ::1],))
        made = [each for each in _swap.overloads if each[0].layout == "C"]
    assert [each[1:] for each in made] == [(numba.int64, numba.int64)]


def test_garbage_is_collected_again_after_a_compilation_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    from cfmkit.elastica.kernels import build

    monkeypatch.setattr(build, "_typed", lambda _name: pytest.fail("no types") if gc.isenabled() else 1 / 0)
    with pytest.raises(ZeroDivisionError):
        build.compiled("states")
    assert gc.isenabled()
    assert "get_call_type" not in vars(numba.types.Function)


_MIXED = """
import numba
from cfmkit.elastica.kernels import build
code = build.compiled("states")
from numba.core.runtime import rtsys
assert rtsys.library.get_pointer_to_function("nrt_unresolved_abort")
@numba.njit
def least(a, b):
    return min(a, b)
assert least(1.0, 2.0) == 1.0
from cfmkit.elastica.kernels.compiler import KERNELS
assert not any(each.overloads for each in KERNELS)
"""


def test_a_process_that_compiled_the_engine_has_its_own_functions_as_before() -> None:
    """Two seconds. The runtime of numba is not made of drafts, and none of the kernels is one."""
    done = subprocess.run([sys.executable, "-P", "-c", _MIXED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


_WAY_IN = "int cfmkit_door(const long long *block, long long *out) { out[0] = 2 * block[0]; return 0; }"


@pytest.fixture
def small(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A kept library of two machine instructions."""
    linker = shutil.which("cc")
    if linker is None:
        pytest.skip("there is no C compiler")
    room = tmp_path_factory.mktemp("source")
    (room / "code.c").write_text(_WAY_IN)
    subprocess.run([linker, "-fPIC", "-c", "code.c"], cwd=room, check=True)
    disk_cache.write("door", machine_code.Code((), (room / "code.o").read_bytes()))
    path = disk_cache.library("door")
    assert path is not None
    return path


def _doubled(call: Any) -> int:
    out = (ctypes.c_int64 * 2)()
    assert call(np.array([21]).tobytes(), out) == 0
    return int(out[0])


def test_code_is_linked_where_there_is_a_compiler_and_runs_alike_where_there_is_none(
    small: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _doubled(machine_code.in_library(small)) == 42
    code = disk_cache.read("door")
    assert code is not None
    assert _doubled(machine_code.loaded(code)) == 42
    monkeypatch.setattr(shutil, "which", lambda _name: None)
    disk_cache.write("other", code)
    assert disk_cache.library("other") is None
    assert disk_cache.read("other") == code


@pytest.mark.parametrize("damage", ["half of it", "of another origin", "others can write to it"])
def test_a_damaged_or_strange_library_is_not_loaded(small: Path, damage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if damage == "half of it":
        small.write_bytes(small.read_bytes()[: small.stat().st_size // 2])
    elif damage == "of another origin":
        disk_cache.origin()
        monkeypatch.setattr(disk_cache, "stamp", lambda: "0" * 64)
        for file in (small, small.with_suffix(".sha256")):
            file.rename(small.with_name(f"door-{'0' * 24}{file.suffix}"))
    else:
        small.chmod(0o666)
    assert disk_cache.library("door") is None


def test_what_is_no_library_is_said_to_be_strange(tmp_path: Path) -> None:
    (tmp_path / "door.so").write_bytes(b"no library")
    with pytest.raises(machine_code.Strange):
        machine_code.in_library(tmp_path / "door.so")


def test_a_library_is_not_opened_by_a_name_that_the_loader_would_replace(small: Path, tmp_path: Path) -> None:
    """`$ORIGIN` is the folder of the program that runs: another one than that which was judged."""
    judged = tmp_path / "$ORIGIN" / small.name
    judged.parent.mkdir()
    small.rename(judged)
    with pytest.raises(machine_code.Strange, match=r"\$"):
        machine_code.in_library(judged)


def test_curves_and_gradients_are_the_same_to_the_last_bit_however_the_code_is_loaded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As it was compiled, by LLVM; and as it is kept, by the system where there is a C compiler."""
    list(warm())
    ours = [part.tobytes() for part in _curve_and_gradient()]
    for name, door in compiled._doors.items():
        code = disk_cache.read(name)
        if code is not None:
            monkeypatch.setattr(door, "_call", machine_code.loaded(code))
    assert [part.tobytes() for part in _curve_and_gradient()] == ours


@pytest.mark.slow  # compiles everything in numba's usual way
def test_curves_and_gradients_are_those_of_numba_to_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    """Optimised function by function, products and sums are fused in other places: the last bits differ."""
    from cfmkit.elastica.kernels import build

    ours = _curve_and_gradient()
    for name in compiled._doors:
        build.compiled(name)  # in the same process, whether or not it was kept before
    for name, door in compiled._doors.items():
        monkeypatch.setattr(door, "_call", machine_code.callable_at(build.called(name)))
    for theirs, own in zip(_curve_and_gradient(), ours, strict=True):
        np.testing.assert_allclose(theirs, own, rtol=0.0, atol=1e-9 * np.abs(own).max())


def _curve_and_gradient() -> list[Any]:
    from cfmkit.elastica import gradient

    def bent(x: Any) -> Network:
        nodes = {"a": Node(0.0, 0.0, CLAMPED), "b": Node(x[0], 0.0), "c": Node(2 * x[0], x[2])}
        section = Section(2e9, 1e-2, x[1])
        return Network(nodes, {"x": Beam("a", "b", section), "y": Beam("b", "c", section)})

    x = np.array([0.1, 2e-3, 0.01])
    path = trace(bent(x), Displacement("c", 1.0, np.linspace(0, 2e-2, 9)[1:]))
    slopes = gradient(path, bent, x)
    return [path.points.y, path.effort, slopes.effort, slopes.held, slopes.stress_extremes("y")]


@pytest.mark.parametrize(
    ("other", "number"),
    [
        (lambda y: y.T, 19),
        (lambda y: y[0], 19),
        (lambda y: y.astype(np.float32), 19),
        (lambda y: np.repeat(y, 2, axis=1)[:, ::2], 19),
        (lambda y: y.astype(int), 19),
        (lambda y: y.tolist(), 19),
        (lambda y: y.astype(y.dtype.newbyteorder()), 19),
        (lambda y: y.view(np.matrix), 19),
    ],
)
def test_what_is_no_array_of_the_right_kind_is_refused(other: Any, number: int) -> None:
    """The compiled code looks into the arrays' own fields, and checks them before it reads any memory."""
    path = trace(*_pulled_beam())
    solver, y = path.solver, np.ascontiguousarray(path.points.y)
    out = np.zeros((len(path), len(solver.cut.edges) + solver.n_segments, 7))
    door = compiled._doors["states"]
    with pytest.raises(TypeError, match=rf"array {number} of 'states': float64, 2 axes, in C order"):
        door(compiled._whole(solver.n_free), solver.model.block, objects((other(y), path.points.drive, out)))
    assert not out.any()


def test_every_field_of_an_array_is_where_the_compiled_code_reads_it() -> None:
    array = np.arange(6.0).reshape(2, 3)

    def word(offset: int, kind: Any = ctypes.c_int64) -> int:
        return int(kind.from_address(id(array) + offset).value)

    assert word(passing_arrays_by_address.TYPE) == id(np.ndarray)
    assert word(passing_arrays_by_address.DATA) == array.__array_interface__["data"][0]
    assert word(passing_arrays_by_address.AXES, ctypes.c_int) == 2
    assert tuple((ctypes.c_int64 * 2).from_address(word(passing_arrays_by_address.SHAPE))) == (2, 3)
    assert word(passing_arrays_by_address.DTYPE) == id(array.dtype)
    ready = passing_arrays_by_address.READY
    assert word(passing_arrays_by_address.FLAGS, ctypes.c_int) & ready == ready


def test_arrays_from_another_process_are_taken() -> None:
    """They bring a dtype of their own, equal to NumPy's but not the same object."""
    network, drive = _pulled_beam()
    here = trace(network, drive)
    sent = trace(*pickle.loads(pickle.dumps((network, drive))))
    array = pickle.loads(pickle.dumps(here.points.y))
    assert array.dtype is not here.points.y.dtype
    np.testing.assert_array_equal(sent.points.y, here.points.y)


def test_copies_of_a_model_have_places_of_their_own() -> None:
    model = trace(*_pulled_beam()).solver.model
    assert model.block == objects(model)
    for other in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model), model._replace(table=model.table.copy())):
        assert other.block == objects(other) != model.block


def test_who_watches_a_compilation_sees_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    class Watched(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Watched()
    monkeypatch.setattr(sys, "stderr", screen)
    with reported("solver") as report:
        report(0.5)
    shown = screen.getvalue().split("\r")
    assert shown[1].endswith("equilibria and paths, about 10 s: 0 %")
    assert shown[2].endswith("50 %")
    assert shown[3].strip() == "" == shown[4]


_ALONE = """
import sys
import numpy as np
from cfmkit.elastica import CLAMPED, Beam, Displacement, Network, Node, Section, gradient, trace
def pulled(x):
    return Network({"a": Node(0.0, 0.0, CLAMPED), "b": Node(0.1, 0.0)}, {"x": Beam("a", "b", Section(2e9, 1e-2, x[0]))})
path = trace(pulled([1e-3]), Displacement("b", 0.0, np.array([1e-4])))
path.peak_stress(), gradient(path, pulled, np.array([1e-3])).held
sys.exit(any(name.split(".")[0] in ("numba", "scipy") for name in sys.modules))
"""


def test_code_that_is_kept_runs_without_numba() -> None:
    list(warm())
    # -P: the package that is tested, not one in the current folder
    assert subprocess.run([sys.executable, "-P", "-c", _ALONE], check=False).returncode == 0


_NOWHERE = """
import logging, sys
from pathlib import Path
from cfmkit.elastica.kernels import disk_cache, machine_code
logging.basicConfig(level=logging.INFO, format="%(message)s")
disk_cache._lasting = lambda: iter([Path("/proc/none")])  # neither package nor home is writable
code = machine_code.Code((), b"code")
before = disk_cache.read("door") == code
disk_cache.write("window", code)
print(disk_cache.write("door", code), before, disk_cache.read("door") == code)
"""


def _without_folders(folder: Path) -> tuple[Path, bool, bool, str]:
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    command = [sys.executable, "-c", _NOWHERE]
    done = subprocess.run(
        command, env=environment | {"TMPDIR": str(folder)}, capture_output=True, text=True, check=True
    )
    place, before, after = done.stdout.split()
    return Path(place), before == "True", after == "True", done.stderr


def test_compiled_code_is_kept_in_a_private_folder_where_nothing_else_is_writable(tmp_path: Path) -> None:
    place, before, after, told = _without_folders(tmp_path)
    assert place == tmp_path / f"cfmkit-compiled-{os.getuid()}"
    assert place.stat().st_mode & 0o777 == 0o700
    assert (before, after) == (False, True)
    assert told.count("compiled code is kept in") == 1
    assert _without_folders(tmp_path)[:3] == (place, True, True)


@pytest.mark.parametrize("trap", ["writable by others", "a link", "a file"])
def test_code_is_never_loaded_from_a_folder_that_others_could_have_prepared(tmp_path: Path, trap: str) -> None:
    private = tmp_path / f"cfmkit-compiled-{os.getuid()}"
    if trap == "writable by others":
        private.mkdir()
        private.chmod(0o777)
    elif trap == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        private.symlink_to(tmp_path / "elsewhere")
    else:
        private.touch()
    place, before, after, _ = _without_folders(tmp_path)
    assert place.parent == tmp_path
    assert place != private
    assert place.stat().st_mode & 0o777 == 0o700
    assert (before, after) == (False, False)


def test_without_any_folder_code_is_compiled_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(disk_cache, "_lasting", lambda: iter(()))
    monkeypatch.setattr(disk_cache, "private_folder", lambda _name, make=True: None)
    assert disk_cache.write("door", CODE) is None
    assert disk_cache.read("door") is None


def test_warming_loads_every_part_of_the_compiled_code() -> None:
    parts = list(warm())
    assert len({part.name for part in parts}) == len(parts) == 5
    assert all(compiled._doors[name]._call is not None for name in DOORS if name != "complex_states")
