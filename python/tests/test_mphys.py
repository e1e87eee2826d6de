"""The components of OpenMDAO."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from box import Box, turned
from test_compat import PLANE, Solver

import idmesh
from idmesh.compat import USMesh

om: Any = pytest.importorskip("openmdao.api", reason='optional: pip install "idmesh[mphys]"')
from idmesh.mphys import ProfileWarper, SurfaceWarper  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore::openmdao.api.OpenMDAOWarning")


class Counted:
    """A mesh that counts its calls, as other programs put it in the mesh's place: it has methods alone."""

    def __init__(self, mesh: USMesh) -> None:
        self.mesh = mesh
        self.calls: list[str] = []

    def __getattr__(self, name: str) -> Any:
        method = getattr(self.mesh, name)

        def call(*arguments: Any) -> Any:
            self.calls.append(name)
            return method(*arguments)

        return call

    def taken(self, name: str) -> int:
        count = self.calls.count(name)
        return count


class Turn(om.ExplicitComponent):  # type: ignore[misc, unused-ignore]
    """Surface points from an angle."""

    def initialize(self) -> None:
        self.options.declare("points")
        self.options.declare("output", default="x_aero")
        self.options.declare("minus", default=0.0)

    def setup(self) -> None:
        points = self.options["points"]
        self.add_input("angle", 0.0)
        self.add_output(self.options["output"], points - self.options["minus"], distributed=False)
        self.declare_partials("*", "*", method="fd", form="central", step=1e-6)

    def compute(self, inputs: Any, outputs: Any) -> None:
        outputs[self.options["output"]] = turned(self.options["points"], float(inputs["angle"][0])) - self.options["minus"]


def model(warper: Any, turn: Any, size: int, mode: str) -> Any:
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("turn", turn, promotes=["*"])
    problem.model.add_subsystem("warper", warper, promotes=["*"])
    weights = np.random.default_rng(4).standard_normal(size)
    problem.model.add_subsystem(
        "number", om.ExecComp("f = sum(w * aero_vol_coords)", w=weights, aero_vol_coords=np.zeros(size)), promotes=["*"]
    )
    problem.model.add_design_var("angle")
    problem.model.add_objective("f")
    problem.setup(mode=mode)
    problem.set_val("angle", 0.15)
    return problem


def difference(problem: Any) -> float:
    ends = []
    for angle in (0.15 + 1e-5, 0.15 - 1e-5):
        problem.set_val("angle", angle)
        problem.run_model()
        ends.append(float(problem.get_val("f")[0]))
    problem.set_val("angle", 0.15)
    problem.run_model()
    return (ends[0] - ends[1]) / 2e-5


@pytest.mark.parametrize("mode", ["fwd", "rev"])
def test_a_surface_warper_in_a_model(box: Box, box_path: Path, mode: str) -> None:
    solver = Solver(box, True)
    mesh = Counted(solver.connect(USMesh({"gridFile": box_path, "backend": "cpu", **PLANE})))
    problem = model(SurfaceWarper(mesh=mesh), Turn(points=solver.points), len(solver.indices), mode)
    problem.run_model()
    assert mesh.taken("warpMesh") == 1
    problem.run_model()
    totals = problem.compute_totals(of=["f"], wrt=["angle"])
    assert mesh.taken("warpMesh") == 1
    assert mesh.taken("warpDeriv" if mode == "rev" else "warpDerivFwd") == 1
    exact = totals["f", "angle"].item()
    assert exact != 0 and abs(exact - difference(problem)) < 1e-6 * abs(exact)
    # Somebody else moves the mesh.
    there = problem.get_val("aero_vol_coords").copy()
    mesh.setSurfaceCoordinates(solver.points)
    mesh.warpMesh()
    problem.run_model()
    assert np.array_equal(problem.get_val("aero_vol_coords"), there)
    # Somebody else moves the mesh, and sets the surface back without moving it.
    at = mesh.getSurfaceCoordinates()
    mesh.setSurfaceCoordinates(solver.points)
    mesh.warpMesh()
    mesh.setSurfaceCoordinates(at)
    problem.run_model()
    assert np.array_equal(problem.get_val("aero_vol_coords"), there)
    data = problem.check_partials(out_stream=None, includes=["warper"])
    assert all(abs(found["abs error"].fwd_rev) < 1e-9 for found in data["warper"].values())


@pytest.mark.parametrize("mode", ["fwd", "rev"])
def test_a_profile_warper_with_a_prescribed_family(mover: idmesh.Mover, mode: str) -> None:
    points = mover.vertices[mover.family_vertices("body")]
    turn = Turn(points=points, output="body", minus=points)
    problem = model(ProfileWarper(mover=mover), turn, mover.vertices.size, mode)
    problem.run_model()
    expected = mover.update(displacements={"body": turned(points, 0.15) - points}).vertices
    assert np.array_equal(problem.get_val("aero_vol_coords"), expected.ravel())
    exact = problem.compute_totals(of=["f"], wrt=["angle"])["f", "angle"].item()
    assert exact != 0 and abs(exact - difference(problem)) < 1e-6 * abs(exact)


def test_profiles_are_inputs_by_number(case: Path) -> None:
    mover = idmesh.Mover.from_case(case, backend="cpu", quality="off")
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("warper", ProfileWarper(mover=mover, output="x"), promotes=["*"])
    problem.setup(mode="rev")
    problem.run_model()
    result = mover.update()
    assert np.array_equal(problem.get_val("x"), result.vertices.ravel())
    ((wing, profiles),) = mover.old_profiles.items()
    names = [f"{wing}_{number}" for number in profiles]
    seed = np.random.default_rng(5).standard_normal(result.vertices.size)
    gradient = problem.compute_jacvec_product(of=["x"], wrt=names, mode="rev", seed=[seed])
    for number, name in zip(profiles, names, strict=True):
        assert np.array_equal(gradient[name], result.reverse(seed).profiles[wing][number])
    problem.set_val(names[0], problem.get_val(names[0]) + [0.0, 0.0, 1e-3])
    problem.run_model()
    assert not np.array_equal(problem.get_val("x"), result.vertices.ravel())


def test_a_mesh_that_may_not_be_used_is_an_analysis_error(box: Box, box_path: Path, mover: idmesh.Mover) -> None:
    solver = Solver(box, False)
    mesh = solver.connect(USMesh({"gridFile": box_path, "backend": "cpu", **PLANE}))
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("dv", om.IndepVarComp("x_aero", solver.points, distributed=True), promotes=["*"])
    problem.model.add_subsystem("warper", SurfaceWarper(mesh=mesh, output="adflow_vol_coords"), promotes=["*"])
    problem.setup()
    problem.set_val("x_aero", solver.points + [0.0, 0.6, 0.0])
    for _ in range(2):
        with pytest.raises(om.AnalysisError, match="inverted|passes through"):
            problem.run_model()
    problem.set_val("x_aero", solver.points)
    problem.run_model()
    assert np.allclose(problem.get_val("adflow_vol_coords"), box.points.ravel(), rtol=0, atol=1e-12)
    other = om.Problem(reports=False)
    other.model.add_subsystem("warper", ProfileWarper(mover=mover), promotes=["*"])
    other.setup()
    other.set_val("body", np.full((len(mover.family_vertices("body")), 3), [0.0, 0.6, 0.0]))
    with pytest.raises(om.AnalysisError):
        other.run_model()


def test_a_complex_step_is_refused(mover: idmesh.Mover) -> None:
    problem = om.Problem(reports=False)
    problem.model.add_subsystem("warper", ProfileWarper(mover=mover), promotes=["*"])
    problem.setup(force_alloc_complex=True)
    problem.run_model()
    problem.set_complex_step_mode(True)
    with pytest.raises(RuntimeError, match="complex step"):
        problem.run_model()
