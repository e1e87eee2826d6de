"""Updates, what they raise, and what goes on beside them."""

import copy
import multiprocessing
import os
import pickle
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from box import Box, Floats, turned, volumes
from conftest import ROLES

import idmesh
from idmesh import _restore

Turn = Callable[..., dict[str, Floats]]


def test_a_turned_body_moves_its_mesh(mover: idmesh.Mover, box: Box, turn: Turn) -> None:
    result = mover.update(displacements=turn(0.3, 0.1))
    body = mover.family_vertices("body")
    assert np.allclose(result.vertices[body], turned(box.points[body], 0.3, 0.1), rtol=0, atol=1e-15)
    far = mover.family_vertices("farfield")
    assert np.array_equal(result.vertices[far], box.points[far])
    plane = mover.family_vertices("symmetry")
    assert np.array_equal(result.vertices[plane, 1], box.points[plane, 1])
    assert volumes(result.vertices, box.tets).min() > 0
    assert result.valid and result.converged and result.inverted == 0
    edges = [np.linalg.norm(result.vertices[mover.tets[:, i]] - result.vertices[mover.tets[:, j]], axis=1)
             for i in range(4) for j in range(i)]
    beta = volumes(result.vertices, mover.tets.astype(np.int64)) / 6 / np.max(edges, axis=0) ** 3
    assert np.allclose(result.beta, beta, rtol=1e-12)


def test_a_surface_that_shifts_as_a_whole_shifts_every_vertex(box_path: Path) -> None:
    mover = idmesh.Mover(box_path, dict.fromkeys(ROLES, "prescribed"), backend="cpu", tolerance=1e-12)
    shift = np.array([0.25, -0.5, 1.0])
    by = {family: np.broadcast_to(shift, (len(mover.family_vertices(family)), 3)) for family in ROLES}
    assert np.allclose(mover.update(displacements=by).displacement, shift, rtol=0, atol=1e-12)


def test_what_is_left_out_is_the_designs(example: idmesh.Mover) -> None:
    design = example.design
    (wing,) = design.profiles
    whole = example.update().vertices
    assert np.array_equal(example.update(profiles=design.profiles).vertices, whole)
    (first, *_) = design.profiles[wing]
    one = example.update(profiles={wing: {first: design.profiles[wing][first]}})
    assert np.array_equal(one.vertices, whole)
    other = example.update(profiles={wing: {first: example.old_profiles[wing][first]}})
    assert not np.array_equal(other.vertices, whole)
    # The design that was handed out is the caller's.
    design.profiles[wing][first][:] = 0.0
    assert np.array_equal(example.update().vertices, whole)


def test_a_mover_without_a_case_does_the_same(case: Path, example: idmesh.Mover) -> None:
    roles: dict[str, Any] = {
        "wing": "wing",
        "wingtip": {"role": "wingtip", "coefficient": 0.5},
        "trailing_edge": "trailing-edge",
        "carenage": "fuselage",
        "symmetry": "plane",
        "farfield": "fixed",
    }
    mesh = case.parent / "wing-body.msh.gz"
    mover = idmesh.Mover(mesh, roles, old_profiles=example.old_profiles, backend="cpu")
    moved = mover.update(profiles=example.design.profiles)
    assert np.array_equal(moved.vertices, example.update().vertices)
    unmoved = mover.update()
    assert np.abs(unmoved.displacement).max() < 1e-12
    # A wing of several families has a name of its own.
    old, new = (profiles["wing"] for profiles in (example.old_profiles, example.design.profiles))
    named = idmesh.Mover(mesh, roles, old_profiles={"any": old}, wings={"any": ["wing"]}, backend="cpu")
    assert np.array_equal(named.update(profiles={"any": new}).vertices, moved.vertices)
    # Old profiles that rise are their own points, which may be matched in either way.
    risen = {number: points + [0.0, 0.0, 0.01] for number, points in old.items()}
    matches: list[Literal["points", "measure"]] = ["points", "measure"]
    for match in matches:
        chosen = pickle.loads(
            pickle.dumps(idmesh.Mover(mesh, roles, old_profiles={"wing": old}, match={"wing": match}, backend="cpu"))
        )
        report = chosen.update(profiles={"wing": risen}).report
        assert report["profiles"]["wing"]["match"] == {str(number): match for number in old}
        fewer = {number: points[::2] for number, points in risen.items()}
        if match == "points":
            with pytest.raises(idmesh.InputError, match="expected as many, in the same order"):
                chosen.update(profiles={"wing": fewer})


def test_a_match_replaces_that_of_a_case(case: Path) -> None:
    """The example's new profiles have other points than the old ones: by measure, unless the keyword forbids it."""
    with pytest.raises(idmesh.InputError, match="`match` has `wings`, expected a wing of the case"):
        idmesh.Mover.from_case(case, backend="cpu", match={"wings": "points"})
    mover = pickle.loads(pickle.dumps(idmesh.Mover.from_case(case, backend="cpu", match={"wing": "points"})))
    with pytest.raises(idmesh.InputError, match="expected as many, in the same order"):
        mover.update()
    risen = {number: points + [0.0, 0.0, 0.01] for number, points in mover.old_profiles["wing"].items()}
    report = mover.update(profiles={"wing": risen}).report
    assert report["profiles"]["wing"]["match"] == {str(number): "points" for number in risen}
    chosen = idmesh.Mover.from_case(case, backend="cpu", match={"wing": "measure"})
    report = chosen.update(profiles={"wing": risen}).report
    assert report["profiles"]["wing"]["match"] == {str(number): "measure" for number in risen}


def test_the_files_are_the_command_lines(example: idmesh.Mover, case: Path, program: str, tmp_path: Path) -> None:
    subprocess.run([program, "run", case, "--backend", "cpu", "-q", "--out", tmp_path / "cli"], check=True)
    written = example.update().write(tmp_path / "moved.vtu")
    assert written == [tmp_path / "moved.vtu"]
    assert (tmp_path / "moved.vtu").read_bytes() == (tmp_path / "cli" / "moved.vtu").read_bytes()


def test_surfaces_are_the_command_lines_and_the_results(
    example: idmesh.Mover, case: Path, program: str, tmp_path: Path
) -> None:
    text = case.read_text().replace("[output]", '[output]\nsurface = ["moved.vtp", "moved.stl", "moved.glb"]')
    other = tmp_path / "case.toml"
    other.write_text(text)
    for name in ["wing-body.msh.gz", "old.csv", "new.csv"]:
        shutil.copy(case.with_name(name), tmp_path)
    subprocess.run([program, "run", other, "--backend", "cpu", "-q", "--out", tmp_path / "cli"], check=True)
    result = example.update()
    for name in ["moved.vtp", "moved.stl", "moved.glb"]:
        assert result.write(tmp_path / name) == [tmp_path / name]
        assert (tmp_path / name).read_bytes() == (tmp_path / "cli" / name).read_bytes()
    pyvista = pytest.importorskip("pyvista", reason='optional: pip install "idmesh[plot]"')
    surface = pyvista.read(tmp_path / "moved.vtp")
    vertices = surface.point_data["vertex"]
    assert np.array_equal(surface.points, result.vertices[vertices])
    assert np.array_equal(surface.point_data["displacement"], result.displacement[vertices])
    for number, family in enumerate(surface.field_data["families"], 1):
        count = int((surface.cell_data["family"] == number).sum())
        assert count == len(example.family_triangles(str(family)))


def test_the_report_is_the_command_lines(example: idmesh.Mover, case: Path, program: str, tmp_path: Path) -> None:
    import json

    out = tmp_path / "report.json"
    subprocess.run([program, "run", case, "--backend", "cpu", "-q", "--out", tmp_path, "--json", out], check=True)
    told = json.loads(out.read_text())
    report = example.update().report
    assert set(report) == set(told)
    for key in ["valid", "converged", "exit", "checks", "mesh", "families", "profiles", "outlines", "solver", "path", "warnings"]:
        assert report[key] == told[key], key
    assert [stage["beta_min"] for stage in report["stages"]] == [stage["beta_min"] for stage in told["stages"]]


def test_updates_do_not_change_later_ones(mover: idmesh.Mover, turn: Turn) -> None:
    first = mover.update(displacements=turn(0.2)).vertices
    mover.update(displacements=turn(0.9, 0.3))
    assert np.array_equal(mover.update(displacements=turn(0.2)).vertices, first)


def test_a_start_from_the_last_design_is_within_the_tolerance(box_path: Path, turn: Turn) -> None:
    mover = idmesh.Mover(box_path, ROLES, backend="cpu", tolerance=1e-8)
    expected = mover.update(displacements=turn(0.21)).vertices
    mover.start_from("last")
    assert mover.starts_from_last
    mover.update(displacements=turn(0.2))
    assert np.allclose(mover.update(displacements=turn(0.21)).vertices, expected, rtol=0, atol=1e-7)
    with pytest.raises(idmesh.InputError, match='"undeformed" or "last"'):
        mover.start_from("first")  # type: ignore[arg-type]


# ---------------------------------------------------------------- exceptions


def test_an_invalid_mesh_raises_and_carries_its_result(mover: idmesh.Mover, turn: Turn, tmp_path: Path) -> None:
    through = {"body": turn(0.0)["body"] + [0.0, 0.6, 0.0]}
    with pytest.raises(idmesh.InvalidMesh, match="inverted|passes through") as caught:
        mover.update(displacements=through)
    result = caught.value.result
    assert not result.valid and caught.value.hint
    unchecked = mover.update(displacements=through, check=False)
    assert not unchecked.valid and unchecked.report["exit"] == 5
    assert np.array_equal(unchecked.vertices, result.vertices)
    # It never gets the name of a valid mesh.
    written = unchecked.write(tmp_path / "moved.su2")
    assert tmp_path / "moved.invalid.su2" in written and not (tmp_path / "moved.su2").exists()


def test_an_exception_goes_to_another_process_without_its_result(mover: idmesh.Mover, turn: Turn) -> None:
    with pytest.raises(idmesh.InvalidMesh) as caught:
        mover.update(displacements={"body": turn(0.0)["body"] + [0.0, 0.6, 0.0]})
    sent = pickle.loads(pickle.dumps(caught.value))
    assert type(sent) is idmesh.InvalidMesh and str(sent) == str(caught.value) and sent.hint == caught.value.hint
    assert sent.result is None


def test_too_few_sweeps_raise_not_converged(box_path: Path, turn: Turn) -> None:
    mover = idmesh.Mover(box_path, ROLES, backend="cpu", method="jacobi", max_sweeps=2, quality="off", max_steps=1)
    with pytest.raises((idmesh.NotConverged, idmesh.InvalidMesh)) as caught:
        mover.update(displacements=turn(0.01))
    assert isinstance(caught.value, idmesh.NotConverged) and not caught.value.result.converged


def test_a_gpu_that_is_not_there_is_a_device_error(box_path: Path) -> None:
    script = (
        "import idmesh, sys\n"
        f"try: idmesh.Mover({str(box_path)!r}, {ROLES!r}, backend='gpu')\n"
        "except idmesh.DeviceError as error: assert isinstance(error, RuntimeError); print(error.hint)\n"
    )
    # Without drivers there is no adapter.
    gone = {"VK_DRIVER_FILES": "/none", "VK_ICD_FILENAMES": "/none"}
    told = subprocess.run([sys.executable, "-c", script], env=os.environ | gone, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    assert "cpu" in told.stdout


@pytest.mark.parametrize(
    "make, told",
    [
        (lambda path: idmesh.Mover(path.with_name("none.su2"), ROLES), "none.su2"),
        (lambda path: idmesh.Mover(path, {**ROLES, "bodi": "fixed"}), "did you mean `body`"),
        (lambda path: idmesh.Mover(path, {"body": "prescribed"}), "no role is given for"),
        (lambda path: idmesh.Mover(path, {**ROLES, "body": "wings"}), '"wings" is no role'),
        (lambda path: idmesh.Mover(path, {**ROLES, "body": {"role": "plane", "flet": 1}}), 'unknown key "flet"'),
        (lambda path: idmesh.Mover(path, {**ROLES, "body": {"flat": 1}}), 'under the key "role"'),
        (lambda path: idmesh.Mover(path, {**ROLES, "symmetry": {"role": "plane", "flat": 7.0}}), "above 0"),
        (lambda path: idmesh.Mover(path, {**ROLES, "body": 3}), "expected a name"),  # type: ignore[dict-item]
        (lambda path: idmesh.Mover(path, {**ROLES, "body": "wing"}), "body"),
        (lambda path: idmesh.Mover(path, ROLES, wings={"outer": ["body"]}), "`wings` has `outer`"),
        (lambda path: idmesh.Mover(path, ROLES, old_profiles={"outer": {}}, wings={"outer": ["bodi"]}), "`body`"),
        (lambda path: idmesh.Mover(path, ROLES, match={"outer": "points"}), "`match` has `outer`"),
        (lambda path: idmesh.Mover(path, ROLES, match={"body": "point"}), "`match`"),  # type: ignore[dict-item]
        (lambda path: idmesh.Mover(path, ROLES, backend="gpus"), "`backend`"),  # type: ignore[arg-type]
        (lambda path: idmesh.Mover(path, ROLES, springs="torsion"), "`springs`"),
        (lambda path: idmesh.Mover(path, ROLES, method="cg"), "`method`"),  # type: ignore[arg-type]
        (lambda path: idmesh.Mover(path, ROLES, quality="best"), "`quality`"),  # type: ignore[arg-type]
        (lambda path: idmesh.Mover(path, ROLES, tolerance=float("nan")), "`tolerance`"),
        (lambda path: idmesh.Mover(path, ROLES, max_sweeps=0), "`max_sweeps`"),
        (lambda path: idmesh.Mover(path, ROLES, max_steps=-1), "`max_steps`"),
        (lambda path: idmesh.Mover(path, ROLES, limits="su2"), "`limits`"),  # type: ignore[arg-type]
        (lambda path: idmesh.Mover(path, ROLES, limits=4), "`limits`"),  # type: ignore[arg-type]
        (lambda path: idmesh.Mover(path, ROLES, limits={"skew": 4}), "`skew`"),
        (lambda path: idmesh.Mover(path, ROLES, limits={"skewness": "4"}), "no number"),  # type: ignore[dict-item]
        (lambda path: idmesh.Mover(path, ROLES, limits={"skewness": float("nan")}), "`skewness`"),
        (lambda path: idmesh.Mover.from_case(path), "expected"),
        (lambda path: idmesh.Mover.from_case(path, match={"body": "point"}), "`match`"),  # type: ignore[dict-item]
        (lambda path: idmesh.Mover.from_case("none.toml"), "none.toml"),
        (lambda path: idmesh.Mesh.read("none.msh"), "none.msh"),
        (lambda path: idmesh.read_profiles("none.csv"), "none.csv"),
    ],
)
def test_bad_input_is_an_input_error(box_path: Path, make: Callable[[Path], Any], told: str) -> None:
    with pytest.raises(idmesh.InputError) as caught:
        make(box_path)
    assert told in str(caught.value) and isinstance(caught.value, ValueError)


def test_a_mesh_beyond_a_limit_is_not_valid(box_path: Path, turn: Turn) -> None:
    """A skewness of 1e-6 is less than any mesh of tets has, one of 100 more."""
    strict = idmesh.Mover(box_path, ROLES, backend="cpu", limits={"skewness": 1e-6})
    for mover in (strict, pickle.loads(pickle.dumps(strict))):
        with pytest.raises(idmesh.InvalidMesh, match="skewness"):
            mover.update(displacements=turn(0.1))
    loose = idmesh.Mover(box_path, ROLES, backend="cpu", limits={"skewness": 100.0})
    assert loose.update(displacements=turn(0.1)).valid
    assert strict.update(displacements=turn(0.1), check=False).beta.min() > 0


def test_a_keyword_replaces_the_limits_of_a_case(case: Path) -> None:
    mover = idmesh.Mover.from_case(case, backend="cpu", limits={"skewness": 1e-6})
    with pytest.raises(idmesh.InvalidMesh, match="skewness"):
        mover.update()


def test_bad_designs_are_input_errors(mover: idmesh.Mover, example: idmesh.Mover) -> None:
    (wing,) = example.design.profiles
    profiles = example.design.profiles[wing]
    number = next(iter(profiles))
    hole = profiles[number].copy()
    hole[3, 2] = np.nan
    for given, told in [
        ({"wng": profiles}, "did you mean"),
        ({wing: {number: hole}}, "finite"),
        ({wing: {number: hole[:, :2]}}, "(k, 3)|(n, 3)"),
        ({wing: {**profiles, 77: profiles[number]}}, "77"),
        ({wing: profiles[number]}, "no mapping"),
    ]:
        with pytest.raises(idmesh.InputError, match=told.replace("(", r"\(").replace(")", r"\)")):
            example.update(profiles=given)  # type: ignore[arg-type]
    with pytest.raises(idmesh.InputError, match="none of the mover's"):
        mover.update(displacements={"farfield": np.zeros((len(mover.family_vertices("farfield")), 3))})
    with pytest.raises(idmesh.InputError, match="did you mean `body`"):
        mover.family_vertices("bdy")


def test_every_exception_has_its_place() -> None:
    for kind, base in [
        (idmesh.InputError, ValueError), (idmesh.DeviceError, RuntimeError), (idmesh.NotConverged, Exception),
        (idmesh.InvalidMesh, Exception), (idmesh.NotDifferentiable, Exception),
    ]:
        assert issubclass(kind, idmesh.IdmeshError) and issubclass(kind, base)


# ---------------------------------------------------------------- progress, signals, threads, processes


def test_progress_hears_the_stages(example: idmesh.Mover) -> None:
    heard: list[str] = []
    example.update(progress=heard.append)
    stages = ["wing", "trailing edge", "rigid", "attached", "carenage", "planes", "volume"]
    assert [stage for stage in heard if stage in stages] == stages


def test_an_exception_in_progress_stops_the_update(mover: idmesh.Mover, turn: Turn) -> None:
    expected = mover.update(displacements=turn(0.2)).vertices
    heard: list[str] = []

    def stop(stage: str) -> None:
        heard.append(stage)
        if stage == "planes":
            raise KeyError(stage)

    with pytest.raises(KeyError, match="planes"):
        mover.update(displacements=turn(0.2), progress=stop)
    assert heard[-1] == "planes"
    assert np.array_equal(mover.update(displacements=turn(0.2)).vertices, expected)


def test_a_mover_does_not_wait_for_itself(mover: idmesh.Mover, turn: Turn) -> None:
    with pytest.raises(idmesh.IdmeshError, match="would wait for itself"):
        mover.update(displacements=turn(0.1), progress=lambda stage: mover.update())
    assert mover.update(displacements=turn(0.1)).valid


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Python's own handler of Ctrl-C. A shell starts its background jobs with Ctrl-C ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_ends_an_update(mover: idmesh.Mover, turn: Turn) -> None:
    def press(stage: str) -> None:
        if stage == "wing":
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        mover.update(displacements=turn(0.1), progress=press)
    assert mover.update(displacements=turn(0.1)).valid


def test_other_threads_run_during_an_update(example: idmesh.Mover) -> None:
    count = [0]
    stop = threading.Event()

    def run() -> None:
        while not stop.is_set():
            count[0] += 1

    # Turns so short that the thread counts little in the turns beside the updates.
    interval = sys.getswitchinterval()
    thread = threading.Thread(target=run)
    thread.start()
    try:
        sys.setswitchinterval(1e-5)
        before = count[0]
        for _ in range(5):
            example.update()
        during = count[0] - before
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        thread.join()
    assert during > 10_000


def test_threads_share_a_mover(mover: idmesh.Mover, turn: Turn) -> None:
    expected = {angle: mover.update(displacements=turn(angle)).vertices for angle in (0.1, 0.2, 0.3, 0.4)}
    found: dict[float, Floats] = {}

    def run(angle: float) -> None:
        found[angle] = mover.update(displacements=turn(angle)).vertices

    threads = [threading.Thread(target=run, args=(angle,)) for angle in expected]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[angle], expected[angle]) for angle in expected)


def in_child(mover: Any, displacements: dict[str, Floats], connection: Any) -> None:
    try:
        connection.send(np.array(mover.update(displacements=displacements).vertices))
    except idmesh.IdmeshError as error:
        connection.send(str(error))


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_a_forked_child_gets_an_error_and_a_spawned_one_an_answer(
    mover: idmesh.Mover, turn: Turn, method: str
) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"this system has no start method {method}")
    expected = mover.update(displacements=turn(0.2)).vertices
    here, there = multiprocessing.Pipe()
    context: Any = multiprocessing.get_context(method)
    child = context.Process(target=in_child, args=(mover, turn(0.2), there))
    child.start()
    assert here.poll(60), "the child hangs"
    answer = here.recv()
    child.join(60)
    if method == "fork":
        assert "spawn" in answer
    else:
        assert np.array_equal(answer, expected)


def test_a_pickled_mover_is_made_again_once(box_path: Path, turn: Turn, tmp_path: Path) -> None:
    path = tmp_path / "box.su2"
    path.write_bytes(box_path.read_bytes())
    roles = dict(ROLES)
    mover = idmesh.Mover(path, roles, backend="cpu", tolerance=1e-6)
    # What the caller does to his mapping later does not reach the copy.
    roles["body"] = "fixed"
    sent = pickle.dumps(mover)
    assert len(sent) < 2000
    one, other = pickle.loads(sent), pickle.loads(sent)
    assert one is other
    expected = mover.update(displacements=turn(0.2)).vertices
    assert np.array_equal(one.update(displacements=turn(0.2)).vertices, expected)
    # A mesh that has changed is read again.
    path.write_text(path.read_text() + "\n")
    assert pickle.loads(sent) is not one
    one.start_from("last")
    assert pickle.loads(pickle.dumps(one)).starts_from_last
    with pytest.raises(TypeError, match="cannot be pickled"):
        pickle.dumps(mover.update(displacements=turn(0.2)))


def test_a_pickled_mover_is_of_the_same_mesh(box_path: Path, box: Box, turn: Turn, tmp_path: Path) -> None:
    path = tmp_path / "box.su2"
    path.write_bytes(box_path.read_bytes())
    mover = idmesh.Mover(path, ROLES, backend="cpu")
    sent = pickle.dumps(mover)
    mover.update(displacements=turn(0.2)).write(tmp_path / "moved.su2")
    (tmp_path / "moved.su2").replace(path)
    with pytest.raises(idmesh.InputError, match="has changed since the mover was made"):
        pickle.loads(sent)


def test_a_copy_of_a_mover_is_its_own(mover: idmesh.Mover, turn: Turn) -> None:
    one, other = copy.deepcopy(mover), copy.deepcopy(mover)
    assert one is not other
    one.start_from("last")
    one.update(displacements=turn(0.3))
    assert not other.starts_from_last
    expected = mover.update(displacements=turn(0.2)).vertices
    assert np.array_equal(other.update(displacements=turn(0.2)).vertices, expected)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_child_does_not_wait_for_a_thread_of_its_parent(mover: idmesh.Mover) -> None:
    sent = pickle.dumps(mover)
    with _restore._lock:
        child = os.fork()
        if child == 0:
            try:
                pickle.loads(sent)
            except idmesh.IdmeshError:
                # Threads of the parent are not in the child, and the mover says so.
                pass
            os._exit(0)
        for _ in range(600):
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                break
            time.sleep(0.1)
        else:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise AssertionError("the child waits")
    assert status == 0


def test_paths_hold_in_another_folder(
    box_path: Path, turn: Turn, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    path = tmp_path / "one" / "box.su2"
    path.write_bytes(box_path.read_bytes())
    monkeypatch.chdir(tmp_path / "one")
    mover = idmesh.Mover("box.su2", ROLES, backend="cpu")
    monkeypatch.chdir(tmp_path / "two")
    assert mover.inputs == [path]
    result = mover.update(displacements=turn(0.1))
    with pytest.raises(idmesh.InputError, match="overwrite"):
        result.write(path)
    assert path.read_bytes() == box_path.read_bytes()
    # A file of the same name in this folder is no input.
    assert result.write("box.su2") == [Path("box.su2")]


def test_the_report_says_whose_design_it_is(example: idmesh.Mover) -> None:
    own = example.update(check=False).report
    assert own["design"] is None and "case" in own["reasons"]["/design"]
    given = example.update(profiles=example.design.profiles, check=False).report
    assert given["design"] == "given to update"


def test_a_pickled_mover_of_a_case_holds_in_another_folder(
    case: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(case.parent)
    mover = idmesh.Mover.from_case("case.toml", backend="cpu", quality="off")
    sent = pickle.dumps(mover)
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(pickle.loads(sent).update().vertices, mover.update().vertices)


def test_outputs_do_not_overwrite_inputs(mover: idmesh.Mover, box_path: Path, turn: Turn, tmp_path: Path) -> None:
    result = mover.update(displacements=turn(0.1))
    before = box_path.read_bytes()
    with pytest.raises(idmesh.InputError, match="overwrite"):
        result.write(box_path)
    assert box_path.read_bytes() == before
    with pytest.raises(idmesh.InputError):
        result.write(tmp_path / "moved.xyz")
    # The written mesh is the result, to the bit.
    result.write(tmp_path / "moved.su2")
    assert np.array_equal(idmesh.Mesh.read(tmp_path / "moved.su2").vertices, result.vertices)
