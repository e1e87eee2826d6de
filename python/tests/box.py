"""A cube of tets with a cubic body in its middle: a mesh that needs no other file."""

from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Box:
    """The cells of [0, 1]^3, `n` along each edge; the body takes `m` along each edge. Each cell is six tets around its
    diagonal. Families: `body`, `symmetry` (y = 0) and `farfield`."""

    def __init__(self, n: int = 7, m: int = 3) -> None:
        low, high = (n - m) // 2, (n + m) // 2
        cells = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        cells = cells[~np.all((cells >= low) & (cells < high), axis=1)]
        paths = []
        for order in permutations(range(3)):
            corners = np.zeros((4, 3), int)
            for step, axis in enumerate(order):
                corners[step + 1 :, axis] += 1
            # Half of the orders go round the other way.
            a, b, c = corners[1:] - corners[0]
            paths.append(corners if np.dot(np.cross(a, b), c) > 0 else corners[[0, 2, 1, 3]])
        grid = (cells[:, None, None, :] + np.array(paths)[None]).reshape(-1, 3)
        places, tets = np.unique(grid, axis=0, return_inverse=True)
        self.tets: Integers = tets.reshape(-1, 4)
        self.points: Floats = places / n
        on_body = np.all((places >= low) & (places <= high), axis=1)
        inner = np.all((places > 0) & (places < n), axis=1) & ~on_body
        self.points[inner] += np.random.default_rng(5).uniform(-0.1, 0.1, (inner.sum(), 3)) / n
        faces = np.concatenate([self.tets[:, list(f)] for f in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))])
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        outer = faces[first[count == 1]]
        is_body = on_body[outer].all(axis=1)
        is_plane = (places[outer, 1] == 0).all(axis=1)
        self.families: dict[str, Integers] = {
            "body": outer[is_body],
            "symmetry": outer[is_plane],
            "farfield": outer[~is_body & ~is_plane],
        }

    def write(self, path: Path) -> Path:
        """As SU2."""
        lines = [f"NDIME= 3\nNELEM= {len(self.tets)}"]
        lines += ["10 " + " ".join(map(str, tet)) for tet in self.tets]
        lines += [f"NPOIN= {len(self.points)}"]
        lines += [" ".join(repr(float(x)) for x in point) for point in self.points]
        lines += [f"NMARK= {len(self.families)}"]
        for name, faces in self.families.items():
            lines += [f"MARKER_TAG= {name}\nMARKER_ELEMS= {len(faces)}"]
            lines += ["5 " + " ".join(map(str, face)) for face in faces]
        path.write_text("\n".join(lines) + "\n")
        return path


def volumes(points: Floats, tets: Integers) -> Floats:
    """Six times the volume of each tet."""
    a, b, c, d = (points[tets[:, corner]] for corner in range(4))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a))


def turned(points: Floats, angle: float, bulge: float = 0.0) -> Floats:
    """The points turned about the line x = z = 1/2, and stretched along it."""
    x, y, z = (points - 0.5).T
    cos, sin = np.cos(angle), np.sin(angle)
    return 0.5 + np.stack([cos * x + sin * z, y * (1 + bulge * x), cos * z - sin * x], axis=-1)
