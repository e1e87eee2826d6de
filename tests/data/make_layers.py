#!/usr/bin/env python3
"""make_layers.py IN.npz OUT.msh [N GROWTH SHARE]: puts N layers of prisms between the walls of a tet mesh and its tets.

IN.npz has the arrays X, T, tris, fam, names of tests/data/hybrid/nacelle.msh.gz before it had layers: half an aircraft with
the families `symmetry` and `farfield`, all others walls. Each wall vertex gets a copy off the wall, in the direction that
looks most along the normals of its faces, at most SHARE of its shortest edge away and no farther than the tets and prisms
around it stay good. The tets take the copies, and the prisms, each GROWTH times as thick as the one below, fill the gap.
Coordinates are multiples of 2^-20. Needs numpy. The file is Gmsh 2.2 in ASCII.
"""
import sys
import numpy as np

CORNERS = [(0, 1, 2, 3), (1, 2, 0, 4), (2, 0, 1, 5), (3, 5, 4, 0), (4, 3, 5, 1), (5, 4, 3, 2)]


def fixed(X):
    return np.round(X * 2**20) / 2**20


def volumes(X, T):
    a, b, c = (X[T[:, k]] - X[T[:, 0]] for k in (1, 2, 3))
    return np.einsum("ij,ij->i", np.cross(a, b), c) / 6


def jacobians(P):
    """Least scaled Jacobian of the corners of each prism."""
    least = np.full(len(P), np.inf)
    for corner in CORNERS:
        a, b, c = (P[:, corner[i]] - P[:, corner[0]] for i in (1, 2, 3))
        sizes = np.prod([np.linalg.norm(e, axis=1) for e in (a, b, c)], axis=0)
        least = np.minimum(least, np.einsum("ij,ij->i", np.cross(a, b), c) / sizes)
    return least


def directions(normals, faces_of, in_plane):
    D = np.zeros((len(faces_of), 3))
    for v, faces in enumerate(faces_of):
        m = normals[faces]
        u = m.mean(0)
        for turn in range(400):
            if in_plane[v]:
                u[1] = 0
            u /= np.linalg.norm(u)
            u = u + m[(m @ u).argmin()] * 1.5 / (turn + 3)
        if in_plane[v]:
            u[1] = 0
        D[v] = u / np.linalg.norm(u)
    return D


def main(source, target, n=3, growth=1.5, share=0.15):
    n, growth, share = int(n), float(growth), float(share)
    d = dict(np.load(source))
    X, T, tris, fam = fixed(d["X"]), d["T"], d["tris"], d["fam"]
    names = [str(name) for name in d["names"]]
    number = {name: i + 1 for i, name in enumerate(names)}
    symmetry = number["symmetry"]
    is_wall = ~np.isin(fam, [symmetry, number["farfield"]])
    W = tris[is_wall]
    inside = {}
    for tet in T:
        for k in range(4):
            inside[tuple(sorted(np.delete(tet, k)))] = tet[k]
    beyond = np.array([inside[tuple(sorted(face))] for face in W])
    normal = lambda W: np.cross(X[W[:, 1]] - X[W[:, 0]], X[W[:, 2]] - X[W[:, 0]])
    out = np.einsum("ij,ij->i", normal(W), X[beyond] - X[W[:, 0]]) < 0
    W = np.where(out[:, None], W[:, [0, 2, 1]], W)
    normals = normal(W) / np.linalg.norm(normal(W), axis=1)[:, None]

    wall = np.unique(W)
    place = np.full(len(X), -1)
    place[wall] = np.arange(len(wall))
    L = place[W]
    faces_of = [[] for _ in wall]
    for face, corners in enumerate(L):
        for v in corners:
            faces_of[v].append(face)
    D = directions(normals, faces_of, np.isin(wall, np.unique(tris[fam == symmetry])))
    edges = np.vstack([L[:, [0, 1]], L[:, [1, 2]], L[:, [2, 0]]])
    shortest = np.full(len(wall), np.inf)
    for k in (0, 1):
        np.minimum.at(shortest, edges[:, k], np.linalg.norm(X[wall[edges[:, 0]]] - X[wall[edges[:, 1]]], axis=1))

    thickness, V = share * shortest, volumes(X, T)
    heights = np.concatenate([[0], np.cumsum([growth**k for k in range(n)])])
    heights /= heights[-1]
    at = lambda k: X[wall] + D * (thickness * heights[k])[:, None]
    for _ in range(25):
        moved = X.copy()
        moved[wall] = at(n)
        bad = np.zeros(len(wall), bool)
        of_tets = place[T[volumes(moved, T) < 0.35 * V]]
        bad[of_tets[of_tets >= 0]] = True
        for k in range(n):
            bad[L[jacobians(np.concatenate([at(k)[L], at(k + 1)[L]], axis=1)) < 0.03].ravel()] = True
        if not bad.any():
            break
        thickness[bad] = np.maximum(0.8 * thickness[bad], 0.02 * shortest[bad])
        for _ in range(2):
            thinner = thickness.copy()
            np.minimum.at(thinner, edges[:, 0], 1.35 * thickness[edges[:, 1]])
            np.minimum.at(thinner, edges[:, 1], 1.35 * thickness[edges[:, 0]])
            thickness = thinner

    levels = [wall] + [len(X) + k * len(wall) + np.arange(len(wall)) for k in range(n)]
    P = fixed(np.vstack([X] + [at(k + 1) for k in range(n)]))
    up = np.arange(len(X))
    up[wall] = levels[-1]
    prisms = np.vstack([np.hstack([levels[k][L], levels[k + 1][L]]) for k in range(n)])
    tris = np.where(is_wall[:, None], tris, up[tris])
    of_plane = {tuple(sorted(pair)) for t in d["tris"][fam == symmetry] for pair in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))}
    quads = [[levels[k][a], levels[k][b], levels[k + 1][b], levels[k + 1][a]] for a, b in np.unique(np.sort(edges), axis=0)
             if tuple(sorted((wall[a], wall[b]))) in of_plane for k in range(n)]
    tets = up[T]
    print(f"{len(P)} vertices, {len(tets)} tets, {len(prisms)} prisms, {len(quads)} quadrilaterals")
    print(f"least volume of a tet over its old one {(volumes(P, tets) / V).min():.3f}, least jacobian {jacobians(P[prisms]).min():.4f}")

    rows = [(2, g, t) for t, g in zip(tris, fam)] + [(3, symmetry, q) for q in quads]
    rows += [(4, len(names) + 1, t) for t in tets] + [(6, len(names) + 1, p) for p in prisms]
    with open(target, "w") as f:
        f.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{len(names) + 1}\n")
        f.writelines(f'2 {i + 1} "{name}"\n' for i, name in enumerate(names))
        f.write(f'3 {len(names) + 1} "fluid"\n$EndPhysicalNames\n$Nodes\n{len(P)}\n')
        f.writelines("%d %r %r %r\n" % (i + 1, *map(float, p)) for i, p in enumerate(P))
        f.write(f"$EndNodes\n$Elements\n{len(rows)}\n")
        f.writelines(f"{i + 1} {kind} 2 {g} {g} {' '.join(str(v + 1) for v in row)}\n" for i, (kind, g, row) in enumerate(rows))
        f.write("$EndElements\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
