"""IDWarp's class, for programs that drive IDWarp: ADflow, DAFoam, and loops of one's own.

`USMesh` has the names, arguments and answers of IDWarp's class; the mesh is moved by a `Mover`. The surface points are
a flow solver's, with doubled points; a "coordinate number" is three times a vertex plus 0, 1 or 2.

Over several processes (`comm` of mpi4py) every method but `getSurfaceCoordinates`, `getSolverGrid` and `getdXs` is
called by all processes together. The first process has the mesh and moves it. What fails on one process raises on all.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import IdmeshError, InputError
from ._idmesh import Mesh, Mover, Result, match_points
from ._options import OWN, checked
from ._processes import Processes

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# A point is a vertex of a family if it is nearer than this share of the family's shortest edge, as in case files.
_MATCH = 1e-3
# A family is in a symmetry plane if its vertices are as near as this share of its size.
_FLAT = 1e-6


class USMesh:
    """A mesh that follows a surface.

    - options: IDWarp's, and `backend`, `tolerance`, `quality`, `springs` and `max_steps` of idmesh.Mover. `tolerance`
      is 1e-10 unless given, for difference quotients and gradients. The numbers of IDWarp's method are taken and have
      no effect.
    - comm: a communicator of mpi4py, or None for one process
    """

    def __init__(self, options: Mapping[str, Any] | None = None, comm: Any = None, debug: bool = False) -> None:
        self.comm = comm
        self._all = Processes(comm)
        self._options = self._all.together(lambda: checked(options))
        self._mesh: Mesh | None = None
        self._mover: Mover | None = None
        self._indices: Integers | None = None
        self._surface: Floats | None = None
        self._grid: Floats | None = None
        self._stale: str | None = None
        self._dxs: Floats | None = None
        self._motions = 0
        # Of the first process: each process's numbers, and the last results by the surface they are for.
        self._counts: list[int] = []
        self._points: list[int] = []
        self._all_indices = np.zeros(0, np.int64)
        self._owner: dict[str, Integers] = {}
        self._warped: tuple[bytes, Result] | None = None
        self._looked: tuple[bytes, Result] | None = None

        def read() -> int:
            self._mesh = Mesh.read(self._options["gridFile"])
            return len(self._mesh.vertices)

        self._n_vertices = self._all.of_first(read)

    # ------------------------------------------------------------------ set-up

    def setExternalMeshIndices(self, ind: ArrayLike) -> None:
        """The coordinate numbers that this process's flow solver has, from 0, in its order. They may be doubled."""

        def check() -> Integers:
            _refuse_masks(ind, "the indices")
            found = np.asarray(ind)
            if found.ndim != 1 or (found.size and found.dtype.kind not in "iu"):
                raise InputError(f"the indices have the shape {found.shape} and type {found.dtype}, expected (n,) integers")
            most = 3 * self._n_vertices
            if found.size and (found.min() < 0 or found.max() >= most):
                raise InputError(
                    f"the indices go from {found.min()} to {found.max()}, expected coordinate numbers from 0 to {most - 1}"
                )
            return found.astype(np.int64)

        self._indices = self._all.together(check)
        parts = self._all.gather(self._indices)
        if parts is not None:
            self._counts = [len(part) for part in parts]
            self._all_indices = np.concatenate(parts)
        self._grid = self._all.scatter(self._split(self._vertices))

    def setSurfaceDefinition(
        self, pts: ArrayLike, conn: Any = None, faceSizes: Any = None, cgnsBlockIDs: Any = None
    ) -> None:
        """The surface points (N, 3) of this process, and its faces. Makes the mover.

        A family moves if all its vertices are among the points of all processes, or if `specifiedSurfaces` names it.
        """

        def check() -> Floats:
            points = _vectors(pts, "the surface points", None)
            if conn is not None and faceSizes is not None and np.size(conn) != int(np.sum(faceSizes)):
                raise InputError(
                    f"the faces have {np.size(conn)} corners, expected {int(np.sum(faceSizes))}, the sum of their sizes"
                )
            return points

        points = self._all.together(check)
        parts = self._all.gather(points)

        def make() -> None:
            assert parts is not None
            self._make_mover(np.concatenate(parts))
            self._points = [len(part) for part in parts]

        self._all.of_first(make)
        # What failed leaves the surface that was there.
        self._surface = points
        self._stale = self._dxs = None
        self._motions += 1
        if self._indices is not None:
            self._grid = self._all.scatter(self._split(self._vertices))

    def _make_mover(self, points: Floats) -> None:
        mesh = self._mesh_of_first()
        inside = set(mesh.inside)
        named = self._options["specifiedSurfaces"]
        families = [family for family in mesh.families if family not in inside]
        found: dict[str, Integers] = {}
        covers = np.zeros(len(points), bool)
        for family in families if named is None else named:
            own = mesh.family_vertices(family)
            at = match_points(points, mesh.vertices[own], _MATCH * _shortest_edge(mesh, family))
            rows = np.full(len(own), -1)
            # Of doubled points the first counts.
            rows[at[at >= 0][::-1]] = np.flatnonzero(at >= 0)[::-1]
            if np.all(rows >= 0) and len(own):
                found[family] = rows
                covers |= at >= 0
            elif named is not None:
                missing = own[np.argmax(rows < 0)] if len(own) else None
                raise InputError(
                    f"`specifiedSurfaces` names `{family}`, but no surface point is at its vertex {missing} "
                    f"{mesh.vertices[missing] if missing is not None else ''}, expected one at each vertex"
                )
        if not found:
            raise InputError(
                "no family has all its vertices among the surface points, expected at least one of "
                + ", ".join(f"`{family}`" for family in families)
            )
        if not np.all(covers):
            index = int(np.argmin(covers))
            raise InputError(
                f"surface point {index} at {points[index]} is at no vertex of a family that moves "
                f"({', '.join(found)}), expected every point at one"
            )
        roles = {family: self._role(mesh, family) for family in families}
        roles.update(dict.fromkeys(found, "prescribed"))
        keywords = {name: self._options[name] for name in OWN if self._options[name] is not None}
        mover = Mover(self._options["gridFile"], roles, **keywords)
        if not np.array_equal(mover.vertices, mesh.vertices):
            raise InputError(
                f"{self._options['gridFile']} has changed since the mesh was made from it, expected the same file"
            )
        self._mover = mover
        self._owner = found
        # Results of another surface are none of this one.
        self._warped = self._looked = None

    def _role(self, mesh: Mesh, family: str) -> str:
        surfaces = self._options["symmetrySurfaces"] or []
        for name in surfaces:
            mesh.family_vertices(name)
        if family in surfaces:
            return "plane"
        at = mesh.vertices[mesh.family_vertices(family)]
        size = np.linalg.norm(np.ptp(at, axis=0)) if len(at) else 0.0
        for point, normal in self._options["symmetryPlanes"] or []:
            unit = np.asarray(normal, float) / np.linalg.norm(normal)
            if len(at) and np.abs((at - np.asarray(point, float)) @ unit).max() <= _FLAT * size:
                return "plane"
        if family in mesh.symmetries and _is_flat(at):
            return "plane"
        return "fixed"

    # ------------------------------------------------------------------ motion

    def getSurfaceCoordinates(self) -> Floats:
        """This process's surface points (N, 3), as they were set last."""
        return self._own_surface().copy()

    def setSurfaceCoordinates(self, coordinates: ArrayLike) -> None:
        """Sets this process's surface points, (N, 3) or flat."""
        n = len(self._own_surface())
        self._surface = self._all.together(lambda: _vectors(coordinates, "the surface coordinates", n))

    def warpMesh(self) -> None:
        """Moves the mesh to the surface that was set.

        Raises InvalidMesh or NotConverged if the moved mesh may not be used. Then there is no grid until a later motion
        succeeds.
        """
        surface = self._gathered_surface()
        self._motions += 1
        self._stale = "the last `warpMesh` failed, so there is no moved grid"

        def warp() -> Result:
            result = self._at(surface)
            self._warped = surface.tobytes(), result
            return result

        self._all.of_first(warp, sends=False)
        if self._indices is not None:
            self._grid = self._all.scatter(self._split(self._vertices))
        self._stale = None

    def getMotionCount(self) -> int:
        """Number of motions so far. Components look whether the grid is still theirs.

        A method, as all of IDWarp's class, so that programs can put an object with the same methods in its place.
        """
        return self._motions

    def getSolverGrid(self) -> Floats:
        """The coordinates that this process has, flat, one for each number of `setExternalMeshIndices`."""
        if self._grid is None:
            raise IdmeshError("`setExternalMeshIndices` comes before `getSolverGrid`")
        if self._stale is not None:
            raise IdmeshError(self._stale)
        return self._grid.copy()

    def getWarpGrid(self) -> Floats:
        """All coordinates of the moved mesh, flat, on the first process; none on the others."""
        if not self._all.is_first:
            return np.zeros(0)
        if self._stale is not None:
            raise IdmeshError(self._stale)
        return np.array(self._vertices()).ravel()

    def getCommonGrid(self) -> Floats:
        """As `getWarpGrid`: the order is the file's."""
        return self.getWarpGrid()

    def writeGrid(self, fileName: str | os.PathLike[str] | None = None) -> None:
        """Writes the mesh at the surface that was set last; see Result.write."""
        surface = self._gathered_surface()

        def write() -> None:
            if fileName is None:
                raise InputError("`writeGrid` needs the name of a file")
            self._at(surface).write(fileName)

        self._all.of_first(write)

    # ------------------------------------------------------------------ derivatives

    def warpDeriv(self, dXv: ArrayLike, solverVec: bool = True) -> None:
        """The transposed product, from the derivative of a number by this process's coordinates. See `getdXs`."""
        parts = self._all.gather(self._all.together(lambda: self._flat(dXv, solverVec)))
        surface = self._gathered_surface()

        def product() -> list[Floats]:
            assert parts is not None
            seed = np.zeros(3 * self._n_vertices)
            np.add.at(seed, self._all_indices if solverVec else np.arange(seed.size), np.concatenate(parts))
            gradient = self._at(surface).reverse(seed)
            by_vertex = np.zeros((self._n_vertices, 3))
            for family, of_family in gradient.displacements.items():
                by_vertex[self._mover_of_first().family_vertices(family)] += of_family
            dxs = np.zeros_like(surface)
            for family, rows in self._owner.items():
                dxs[rows] = by_vertex[self._mover_of_first().family_vertices(family)]
            return np.split(dxs, np.cumsum(self._points)[:-1])

        self._dxs = self._all.scatter(self._all.of_first(product, sends=False))

    def getdXs(self) -> Floats:
        """What `warpDeriv` found: the derivative (N, 3) by this process's surface points. Of doubled points, over all
        processes, the first has it, and the others have zero."""
        if self._dxs is None:
            raise IdmeshError("`warpDeriv` comes before `getdXs`")
        return self._dxs.copy()

    def warpDerivFwd(self, dXs: ArrayLike, solverVec: bool = True) -> Floats:
        """The change of this process's coordinates for a change of its surface points, (N, 3) or flat.

        Moves the mesh first if the surface was set and not moved to. Of doubled points the first counts.
        """
        n = len(self._own_surface())
        parts = self._all.gather(self._all.together(lambda: _vectors(dXs, "the direction", n)))
        if self._all.share(self._has_moved_surface()):
            self.warpMesh()

        def product() -> list[Floats]:
            assert parts is not None
            direction = np.concatenate(parts)
            moved = {family: direction[rows] for family, rows in self._owner.items()}
            change = self._result_of_first().forward(displacements=moved).ravel()
            if not solverVec:
                return [change, *[np.zeros(0)] * (self._all.size - 1)]
            return np.split(change[self._all_indices], np.cumsum(self._counts)[:-1])

        return self._all.scatter(self._all.of_first(product, sends=False))

    def verifyWarpDeriv(
        self,
        dXv: ArrayLike | None = None,
        solverVec: bool = True,
        dofStart: int = 0,
        dofEnd: int = 10,
        h: float = 1e-6,
        randomSeed: int = 314,
    ) -> list[tuple[int, float, float]]:
        """Compares the transposed product with central differences of step `h`, for the coordinates `dofStart` to
        `dofEnd` of all surface points. Prints and returns the coordinate, the product and the difference."""
        self._flat(np.zeros(0 if self._indices is None else len(self._indices)), True)
        assert self._indices is not None
        if dXv is None:
            dXv = np.random.default_rng(randomSeed).standard_normal(len(self._indices))
        seed = np.asarray(dXv, float)
        self.warpDeriv(seed, solverVec)
        before = self.getSurfaceCoordinates()
        n = 3 * self._all.share(len(self._gathered_surface()))
        if not 0 <= dofStart <= dofEnd <= n:
            raise InputError(f"`dofStart` is {dofStart} and `dofEnd` {dofEnd}, expected numbers from 0 to {n} in order")
        try:
            rows = self._differences(seed, solverVec, range(dofStart, dofEnd), before, h)
        finally:
            # A probe that fails leaves neither its surface nor its want of a grid.
            self.setSurfaceCoordinates(before)
            self.warpMesh()
        if self._all.is_first:
            for dof, product, difference in rows:
                print(f"{dof:6d} product {product: .12e} difference {difference: .12e}")
        return rows

    def _differences(
        self, seed: Floats, solverVec: bool, dofs: Iterable[int], before: Floats, h: float
    ) -> list[tuple[int, float, float]]:
        """For each coordinate of all surface points the product and the central difference of step `h`."""
        start = self._all.before(len(before))
        rows = []
        for dof in dofs:
            ends = []
            for sign in (1.0, -1.0):
                moved = before.copy().ravel()
                here = dof - 3 * start
                if 0 <= here < moved.size:
                    moved[here] += sign * h
                self.setSurfaceCoordinates(moved)
                self.warpMesh()
                grid = self.getSolverGrid() if solverVec else self.getWarpGrid()
                ends.append(self._all.sum_of(float(seed @ grid)))
            here = dof - 3 * start
            own = self.getdXs().ravel()[here] if 0 <= here < before.size else 0.0
            rows.append((dof, self._all.sum_of(float(own)), (ends[0] - ends[1]) / (2.0 * h)))
        return rows

    # ------------------------------------------------------------------ parts

    def _mesh_of_first(self) -> Mesh:
        assert self._mesh is not None
        return self._mesh

    def _mover_of_first(self) -> Mover:
        assert self._mover is not None
        return self._mover

    def _result_of_first(self) -> Result:
        assert self._warped is not None
        return self._warped[1]

    def _vertices(self) -> Floats:
        """The vertices after the last motion; on the first process."""
        return self._mesh_of_first().vertices if self._warped is None else self._warped[1].vertices

    def _own_surface(self) -> Floats:
        if self._surface is None:
            raise IdmeshError("`setSurfaceDefinition` comes before the surface coordinates")
        return self._surface

    def _gathered_surface(self) -> Floats:
        parts = self._all.gather(self._all.together(self._own_surface))
        return np.zeros((0, 3)) if parts is None else np.concatenate(parts)

    def _has_moved_surface(self) -> bool:
        """Whether the surface is another than that of the last motion; on the first process."""
        surface = self._gathered_surface()
        return self._all.is_first and (self._warped is None or self._warped[0] != surface.tobytes())

    def _at(self, surface: Floats) -> Result:
        """The result for a surface: one that is there, or a new one."""
        key = surface.tobytes()
        for known in (self._warped, self._looked):
            if known is not None and known[0] == key:
                return known[1]
        mover = self._mover_of_first()
        undeformed = self._mesh_of_first().vertices
        moved = {
            family: surface[rows] - undeformed[mover.family_vertices(family)] for family, rows in self._owner.items()
        }
        result = mover.update(displacements=moved)
        self._looked = key, result
        return result

    def _split(self, vertices: Callable[[], Floats]) -> list[Floats] | None:
        """Each process's coordinates; on the first process."""
        if not self._all.is_first:
            return None
        flat = np.asarray(vertices()).ravel()[self._all_indices]
        return np.split(flat, np.cumsum(self._counts)[:-1])

    def _flat(self, dXv: ArrayLike, solver: bool) -> Floats:
        if self._indices is None:
            raise IdmeshError("`setExternalMeshIndices` comes before products")
        n = len(self._indices) if solver else 3 * self._n_vertices * self._all.is_first
        found = _real(dXv, "the seed").ravel()
        if len(found) != n:
            raise InputError(f"the seed has {len(found)} entries, expected {n}")
        if not np.all(np.isfinite(found)):
            raise InputError(f"entry {int(np.argmin(np.isfinite(found)))} of the seed is not finite")
        return found


def _refuse_masks(array: ArrayLike, what: str) -> None:
    """A mask would be lost without a word."""
    rows = array if isinstance(array, (list, tuple)) else []
    if np.ma.is_masked(array) or any(np.ma.is_masked(row) for row in rows):
        raise InputError(f"{what} have masked entries, expected a number for each")


def _real(array: ArrayLike, what: str) -> Floats:
    _refuse_masks(array, what)
    found = np.array(array)
    if found.dtype.kind not in "fiu":
        raise InputError(f"{what} hold values of type {found.dtype}, expected real numbers")
    return found.astype(np.float64)


def _vectors(array: ArrayLike, what: str, n: int | None) -> Floats:
    found = _real(array, what)
    rows = found.reshape(-1, 3) if found.size % 3 == 0 else None
    if rows is None or (n is not None and len(rows) != n) or (found.ndim == 2 and found.shape[1] != 3):
        wanted = "(n, 3)" if n is None else f"({n}, 3)"
        raise InputError(f"{what} have the shape {found.shape}, expected {wanted} or flat")
    if not np.all(np.isfinite(rows)):
        raise InputError(f"{what} have a number in row {int(np.argmin(np.isfinite(rows).all(axis=1)))} that is not finite")
    return rows


def _is_flat(points: Floats) -> bool:
    """Whether the points lie in one plane. Files call curved families symmetric too, such as those of a wedge."""
    if len(points) < 3:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[2] <= _FLAT * sizes[0])


def _shortest_edge(mesh: Mesh, family: str) -> float:
    lengths: list[Sequence[float] | Floats] = [np.array([np.inf])]
    for faces in (mesh.family_triangles(family), mesh.family_quadrilaterals(family)):
        for corner in range(faces.shape[1]):
            ends = mesh.vertices[faces[:, corner]] - mesh.vertices[faces[:, corner - 1]]
            lengths.append(np.linalg.norm(ends, axis=1))
    shortest = float(min(np.min(length) for length in lengths if len(length)))
    return shortest if np.isfinite(shortest) and shortest > 0 else 1e-12
