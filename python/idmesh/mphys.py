"""Components of OpenMDAO that move a mesh. MPhys promotes their variables by tag; mphys itself is not needed.

| component | inputs | output |
|---|---|---|
| `SurfaceWarper(mesh=USMesh)` | `x_aero`, a flow solver's surface points | `aero_vol_coords` |
| `ProfileWarper(mover=Mover)` | `WING_NUMBER` (k, 3) for each profile, `FAMILY` (k, 3) for each prescribed family | `aero_vol_coords` |

A mesh that may not be used becomes `openmdao.api.AnalysisError`, at which an optimiser tries a shorter step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import openmdao.api as om
from numpy.typing import NDArray

from ._errors import IdmeshError, InvalidMesh, NotConverged
from ._idmesh import Result

Floats = NDArray[np.float64]


class _Warper(om.ExplicitComponent):  # type: ignore[misc, unused-ignore]
    """What both components do alike."""

    def _declare_checks(self) -> None:
        # One direction instead of a product for every entry of every vector.
        self.set_check_partial_options(wrt="*", directional=True)

    def _refuse_complex_step(self) -> None:
        if self.under_complex_step:
            raise RuntimeError(f"{self.msginfo}: idmesh has no complex step, expected method='fd' or matrix-free products")


class SurfaceWarper(_Warper):
    """Moves the mesh of a `USMesh` to surface points.

    - mesh: the `idmesh.compat.USMesh`, after `setExternalMeshIndices` and `setSurfaceDefinition`
    - output: the name of the output, "aero_vol_coords" unless given
    """

    def initialize(self) -> None:
        self.options.declare("mesh", recordable=False)
        self.options.declare("output", default="aero_vol_coords", types=str)

    def setup(self) -> None:
        size = self.options["mesh"].getSolverGrid().size
        self.add_input("x_aero", distributed=True, shape_by_conn=True, tags=["mphys_coupling"])
        self.add_output(self.options["output"], distributed=True, shape=size, tags=["mphys_coupling"])
        self._declare_checks()
        self._at: Floats | None = None
        self._motions = -1

    def _warp(self, inputs: Any) -> None:
        self._refuse_complex_step()
        mesh = self.options["mesh"]
        points = np.array(inputs["x_aero"]).reshape(-1, 3)
        # Another user of the mesh may have moved it meanwhile.
        known = self._at is not None and np.array_equal(points, self._at)
        known = known and self._motions == mesh.getMotionCount() and np.array_equal(points, mesh.getSurfaceCoordinates())
        if self.comm.size > 1:
            known = all(self.comm.allgather(known))
        if known:
            return
        self._at = None
        try:
            mesh.setSurfaceCoordinates(points)
            mesh.warpMesh()
        except (InvalidMesh, NotConverged) as error:
            raise om.AnalysisError(f"{self.msginfo}: {error}") from error
        self._at, self._motions = points, mesh.getMotionCount()

    def compute(self, inputs: Any, outputs: Any, discrete_inputs: Any = None, discrete_outputs: Any = None) -> None:
        self._warp(inputs)
        outputs[self.options["output"]] = self.options["mesh"].getSolverGrid()

    def compute_jacvec_product(self, inputs: Any, d_inputs: Any, d_outputs: Any, mode: str, *discrete: Any) -> None:
        self._warp(inputs)
        mesh, output = self.options["mesh"], self.options["output"]
        if output not in d_outputs or "x_aero" not in d_inputs:
            return
        if mode == "fwd":
            d_outputs[output] += mesh.warpDerivFwd(np.array(d_inputs["x_aero"]).reshape(-1, 3))
        else:
            mesh.warpDeriv(np.array(d_outputs[output]))
            d_inputs["x_aero"] += mesh.getdXs().reshape(np.shape(d_inputs["x_aero"]))


class ProfileWarper(_Warper):
    """Moves the mesh of a `Mover` to new profiles and displacements. The first values are those of `mover.design`.

    - mover: the `idmesh.Mover`
    - output: the name of the output, "aero_vol_coords" unless given

    Each process of a parallel model moves the whole mesh.
    """

    def initialize(self) -> None:
        self.options.declare("mover", recordable=False)
        self.options.declare("output", default="aero_vol_coords", types=str)

    def setup(self) -> None:
        mover = self.options["mover"]
        design = mover.design
        self._profiles = {
            f"{wing}_{number}": (wing, number)
            for wing, profiles in design.profiles.items()
            for number in profiles
        }
        self._families = list(design.displacements)
        for name, (wing, number) in self._profiles.items():
            self.add_input(name, design.profiles[wing][number], tags=["mphys_input"])
        for family in self._families:
            if family in self._profiles:
                raise IdmeshError(f"the family `{family}` and a profile would be inputs of one name")
            self.add_input(family, design.displacements[family], tags=["mphys_input"])
        self.add_output(self.options["output"], mover.vertices.ravel(), tags=["mphys_coupling"])
        self._declare_checks()
        self._last: tuple[bytes, Result] | None = None

    def _result(self, inputs: Any) -> Result:
        self._refuse_complex_step()
        key = b"".join(np.array(inputs[name]).tobytes() for name in [*self._profiles, *self._families])
        if self._last is not None and self._last[0] == key:
            return self._last[1]
        profiles: dict[str, dict[int, Floats]] = {}
        for name, (wing, number) in self._profiles.items():
            profiles.setdefault(wing, {})[number] = np.array(inputs[name])
        displacements = {family: np.array(inputs[family]) for family in self._families}
        try:
            result: Result = self.options["mover"].update(profiles, displacements)
        except (InvalidMesh, NotConverged) as error:
            raise om.AnalysisError(f"{self.msginfo}: {error}") from error
        self._last = key, result
        return result

    def compute(self, inputs: Any, outputs: Any, discrete_inputs: Any = None, discrete_outputs: Any = None) -> None:
        outputs[self.options["output"]] = self._result(inputs).vertices.ravel()

    def compute_jacvec_product(self, inputs: Any, d_inputs: Any, d_outputs: Any, mode: str, *discrete: Any) -> None:
        result, output = self._result(inputs), self.options["output"]
        if output not in d_outputs:
            return
        given = [name for name in [*self._profiles, *self._families] if name in d_inputs]
        if not given:
            return
        if mode == "fwd":
            profiles: dict[str, dict[int, Floats]] = {}
            for name in given:
                if name in self._profiles:
                    wing, number = self._profiles[name]
                    profiles.setdefault(wing, {})[number] = np.array(d_inputs[name])
            displacements = {name: np.array(d_inputs[name]) for name in given if name not in self._profiles}
            d_outputs[output] += result.forward(profiles, displacements).ravel()
            return
        gradient = result.reverse(np.array(d_outputs[output]))
        for name in given:
            if name in self._profiles:
                wing, number = self._profiles[name]
                d_inputs[name] += gradient.profiles[wing][number]
            else:
                d_inputs[name] += gradient.displacements[name]
