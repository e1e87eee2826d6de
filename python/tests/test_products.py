"""Derivatives of a result."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from box import Floats
from conftest import ROLES

import idmesh

Turn = Callable[..., dict[str, Floats]]


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_reverse_is_the_transpose_of_forward(springs: idmesh.Mover, turn: Turn, angle: float) -> None:
    result = springs.update(displacements=turn(angle, angle))
    assert result.differentiable and result.why_not is None
    rng = np.random.default_rng(1)
    direction = {"body": rng.standard_normal(turn(0.0)["body"].shape)}
    seed = rng.standard_normal(springs.vertices.shape)
    forward = result.forward(displacements=direction)
    gradient = result.reverse(seed)
    assert gradient.profiles == {} and gradient.displacements["body"].shape == direction["body"].shape
    apart = np.sum(seed * forward) - np.sum(gradient.displacements["body"] * direction["body"])
    assert abs(apart) < 1e-12 * np.linalg.norm(seed) * np.linalg.norm(forward)
    assert np.array_equal(result.reverse(seed.ravel()).displacements["body"], gradient.displacements["body"])


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_forward_is_the_limit_of_differences(springs: idmesh.Mover, turn: Turn, angle: float) -> None:
    at = turn(angle, angle)["body"]
    x = springs.vertices[springs.family_vertices("body")]
    direction = np.sin(3 * x[:, [1, 2, 0]])
    forward = springs.update(displacements={"body": at}).forward(displacements={"body": direction})
    h = 1e-5
    ends = [springs.update(displacements={"body": at + sign * h * direction}).vertices for sign in (1, -1)]
    difference = (ends[0] - ends[1]) / (2 * h)
    assert np.linalg.norm(difference - forward) < 1e-8 * np.linalg.norm(forward)


def test_products_of_an_earlier_result_are_those_asked_for_at_once(springs: idmesh.Mover, turn: Turn) -> None:
    result = springs.update(displacements=turn(0.2))
    seed = np.random.default_rng(2).standard_normal(springs.vertices.shape)
    at_once = result.reverse(seed).displacements["body"]
    later = springs.update(displacements=turn(0.5)).vertices
    assert np.array_equal(result.reverse(seed).displacements["body"], at_once)
    assert np.array_equal(springs.update(displacements=turn(0.5)).vertices, later)


def test_a_result_without_derivative_says_why(box_path: Path, turn: Turn) -> None:
    mover = idmesh.Mover(box_path, ROLES, backend="cpu", quality="improve", tolerance=1e-8)
    improved = mover.update(displacements=turn(0.3, 0.3))
    assert not improved.differentiable and "optimisation" in str(improved.why_not)
    direction = {"body": turn(0.1)["body"]}
    with pytest.raises(idmesh.NotDifferentiable):
        improved.forward(displacements=direction)
    assert np.all(np.isfinite(improved.forward(displacements=direction, frozen=True)))


def test_directions_and_seeds_are_checked(springs: idmesh.Mover, turn: Turn) -> None:
    result = springs.update(displacements=turn(0.2))
    n = len(springs.vertices)
    with pytest.raises(idmesh.InputError, match=rf"expected \({n}, 3\)"):
        result.reverse(np.zeros((n - 1, 3)))
    with pytest.raises(idmesh.InputError, match="finite"):
        result.reverse(np.full((n, 3), np.nan))
    with pytest.raises(idmesh.InputError, match="did you mean `body`"):
        result.forward(displacements={"bodi": turn(0.2)["body"]})
    with pytest.raises(idmesh.InputError, match="expected"):
        result.forward(displacements={"body": turn(0.2)["body"][:-1]})
    with pytest.raises(idmesh.InputError, match="none of the wings"):
        result.forward(profiles={"body": {1: np.zeros((3, 3))}})


def test_profiles_have_products(case: Path) -> None:
    mover = idmesh.Mover.from_case(case, backend="cpu", quality="off", tolerance=1e-10)
    new = mover.design.profiles
    result = mover.update()
    assert result.differentiable
    bumps = {number: np.sin(3 * points[:, [1, 2, 0]]) * [1, 0, 1] for number, points in new["wing"].items()}
    change = result.forward(profiles={"wing": bumps})
    seed = np.random.default_rng(3).standard_normal(change.shape)
    gradient = result.reverse(seed)
    assert {number: by.shape for number, by in gradient.profiles["wing"].items()} == {
        number: points.shape for number, points in new["wing"].items()
    }
    slope = sum(np.sum(gradient.profiles["wing"][number] * bump) for number, bump in bumps.items())
    assert abs(np.sum(seed * change) - slope) < 1e-10 * np.linalg.norm(seed) * np.linalg.norm(change)
    ends = [
        mover.update({"wing": {number: points + step * bumps[number] for number, points in new["wing"].items()}}).vertices
        for step in (1e-6, -1e-6)
    ]
    assert np.linalg.norm((ends[0] - ends[1]) / 2e-6 - change) < 1e-4 * np.linalg.norm(change)
    only = result.forward(profiles={"wing": {number: bumps[number] for number in list(bumps)[:1]}})
    assert 0 < np.linalg.norm(only) < np.linalg.norm(change)
    with pytest.raises(idmesh.InputError, match="numbers"):
        result.forward(profiles={"wing": {999: np.zeros((3, 3))}})
