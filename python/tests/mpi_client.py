"""Run by `test_mpi.py` in several processes: a warper whose nodes and patches are divided among them."""

import sys

import numpy as np
from box import Box, turned
from mpi4py import MPI
from test_compat import PLANE, Solver

import idmesh
from idmesh.compat import USMesh

comm = MPI.COMM_WORLD
box = Box()
whole = Solver(box, False)
# Shares of the nodes that overlap. The last process has no surface.
shares = np.array_split(np.arange(len(box.points)), comm.size)
nodes = np.append(shares[comm.rank], shares[(comm.rank + 1) % comm.size][:9])
indices = (3 * nodes[:, None] + np.arange(3)).ravel()
owners = max(1, comm.size - 1)
own = np.array_split(np.arange(len(whole.surface)), owners)[comm.rank] if comm.rank < owners else np.zeros(0, int)
surface = whole.surface[own]

mesh = USMesh({"gridFile": sys.argv[1], "backend": "cpu", **PLANE}, comm=comm)
mesh.setExternalMeshIndices(indices)
mesh.setSurfaceDefinition(box.points[surface])
assert np.array_equal(mesh.getSolverGrid().reshape(-1, 3), box.points[nodes])
x = turned(box.points[surface], 0.2, 0.1)
mesh.setSurfaceCoordinates(x)
mesh.warpMesh()

# As one process does it, to the bit.
alone = whole.connect(USMesh({"gridFile": sys.argv[1], "backend": "cpu", **PLANE}))
alone.setSurfaceCoordinates(turned(whole.points, 0.2, 0.1))
alone.warpMesh()
assert np.array_equal(mesh.getSolverGrid(), alone.getSolverGrid()[indices])

rng = np.random.default_rng(comm.rank)
seed, direction = rng.standard_normal(len(indices)), rng.standard_normal(x.shape)
change = mesh.warpDerivFwd(direction)
mesh.warpDeriv(seed)
dxs = mesh.getdXs()
assert dxs.shape == x.shape
apart = comm.allreduce(float(seed @ change) - float(np.sum(dxs * direction)))
norms = np.sqrt(comm.allreduce(float(seed @ seed)) * comm.allreduce(float(change @ change)))
assert norms > 0 and abs(apart) < 1e-12 * norms, apart / norms
rows = mesh.verifyWarpDeriv(dofStart=0, dofEnd=2, h=1e-5)
assert all(abs(product - difference) < 1e-4 * (1 + abs(product)) for _, product, difference in rows)

# What is wrong on one process raises on all, whichever it is; so does what the first process finds alone.
for rank in range(owners):
    try:
        mesh.setSurfaceCoordinates(x * (np.nan if comm.rank == rank else 1.0))
        raise SystemExit("nothing raised")
    except idmesh.InputError as error:
        assert (f"process {rank}" in str(error)) == (comm.rank != rank), error
mesh.setSurfaceCoordinates(x + [0.0, 0.6, 0.0])
try:
    mesh.warpMesh()
    raise SystemExit("nothing raised")
except idmesh.InvalidMesh as error:
    assert (error.result is None) == (comm.rank > 0)
try:
    USMesh({"gridFile": "none.su2"}, comm=comm)
    raise SystemExit("nothing raised")
except idmesh.InputError as error:
    assert "none.su2" in str(error)
print("passed")
