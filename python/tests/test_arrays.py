"""Arrays in and out."""

from collections.abc import Callable

import numpy as np
import pytest
from box import Box, Floats

import idmesh

Turn = Callable[..., dict[str, Floats]]


def test_the_mesh_is_the_files(mover: idmesh.Mover, box: Box) -> None:
    assert np.array_equal(mover.vertices, box.points)
    assert np.array_equal(np.sort(mover.tets, axis=1), np.sort(box.tets, axis=1))
    assert mover.families == list(box.families)
    for family, faces in box.families.items():
        assert np.array_equal(mover.family_vertices(family), np.unique(faces))
        assert np.array_equal(mover.family_triangles(family), faces)
    assert mover.tets.dtype == np.uint32 and mover.vertices.dtype == np.float64
    assert {kind: cells.shape for kind, cells in mover.cells.items()} == {
        "tets": (len(box.tets), 4),
        "pyramids": (0, 5),
        "prisms": (0, 6),
        "hexahedra": (0, 8),
    }


def test_arrays_are_made_once_and_read_only(mover: idmesh.Mover, turn: Turn) -> None:
    result = mover.update(displacements=turn(0.1))
    for owner, name in [(mover, "vertices"), (result, "vertices"), (result, "displacement"), (result, "beta")]:
        array = getattr(owner, name)
        assert array is getattr(owner, name) or np.shares_memory(array, getattr(owner, name))
        assert array.flags.c_contiguous and not array.flags.writeable
        with pytest.raises(ValueError):
            array[0] = 0.0
        with pytest.raises(ValueError):
            array.flags.writeable = True
    assert np.allclose(result.vertices, mover.vertices + result.displacement, rtol=0, atol=1e-15)


def test_the_memory_outlives_its_result(mover: idmesh.Mover, turn: Turn) -> None:
    vertices = mover.update(displacements=turn(0.1)).vertices
    before = vertices.copy()
    mover.update(displacements=turn(0.3))
    assert np.array_equal(vertices, before)


@pytest.mark.parametrize("form", ["fortran", "strided", "reversed", "list", "flat", "big-endian", "read-only", "unaligned"])
def test_every_form_of_an_array_has_the_same_bits(mover: idmesh.Mover, turn: Turn, form: str) -> None:
    rows = turn(0.2, 0.1)["body"]
    wide = np.zeros((2 * len(rows), 6))
    wide[::2, ::2] = rows
    unaligned = np.frombuffer(b"x" + rows.tobytes(), np.uint8)[1:].view(np.float64).reshape(-1, 3)
    read_only = rows.copy()
    read_only.flags.writeable = False
    forms = {
        "fortran": np.asfortranarray(rows),
        "strided": wide[::2, ::2],
        "reversed": rows[::-1].copy()[::-1],
        "list": rows.tolist(),
        "flat": rows.ravel(),
        "big-endian": rows.astype(">f8"),
        "read-only": read_only,
        "unaligned": unaligned,
    }
    expected = mover.update(displacements={"body": rows}).vertices
    assert np.array_equal(mover.update(displacements={"body": forms[form]}).vertices, expected)


def test_single_precision_is_converted(mover: idmesh.Mover, turn: Turn) -> None:
    rows = turn(0.2)["body"].astype(np.float32)
    expected = mover.update(displacements={"body": rows.astype(np.float64)}).vertices
    assert np.array_equal(mover.update(displacements={"body": rows}).vertices, expected)


@pytest.mark.parametrize(
    "wrong, told",
    [
        (lambda rows: rows[:-1], "expected (56, 3) or (168,)"),
        (lambda rows: rows[:, :2], "has the shape (56, 2)"),
        (lambda rows: rows.T, "has the shape (3, 56)"),
        (lambda rows: rows[None], "has the shape (1, 56, 3)"),
        (lambda rows: rows.ravel()[:-3], "has the shape (165,)"),
        (lambda rows: rows.astype(complex), "type complex128, expected real numbers"),
        (lambda rows: rows.astype(str), "expected real numbers"),
        (lambda rows: rows.astype(object), "type object, expected real numbers"),
        (lambda rows: [[0.0, 0.0, 0.0], [0.0]], "is no array"),
        (lambda rows: np.ma.masked_greater(rows, 0.0), "masked entries"),
        (lambda rows: list(np.ma.masked_greater(rows, 0.0)), "masked entries"),
        (lambda rows: np.where(rows == rows.max(), np.nan, rows), "expected finite numbers"),
        (lambda rows: np.where(rows == rows.max(), np.inf, rows), "expected finite numbers"),
        (lambda rows: None, "expected real numbers"),
    ],
)
def test_wrong_arrays_are_refused(
    mover: idmesh.Mover, turn: Turn, wrong: Callable[[Floats], object], told: str
) -> None:
    rows = turn(0.2)["body"]
    assert len(rows) == 56
    with pytest.raises(idmesh.InputError) as caught:
        mover.update(displacements={"body": wrong(rows)})  # type: ignore[dict-item]
    assert told in str(caught.value) and "`body`" in str(caught.value)
    # What was refused leaves nothing behind.
    assert mover.update(displacements=turn(0.0)).valid
