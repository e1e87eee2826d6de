"""The exceptions: one class for each exit code of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._idmesh import Result


class IdmeshError(Exception):
    """Base of all exceptions of idmesh."""

    hint: str | None = None
    """What may help, if anything is known to. It is in the message too."""

    def __reduce__(self) -> tuple[Any, ...]:
        # A result stays in its process: what is sent to another one has `result = None`.
        state = {name: value for name, value in self.__dict__.items() if name != "result"}
        return type(self), self.args, state


class InputError(IdmeshError, ValueError):
    """A file, a case, a design or an array is wrong (exit code 3)."""


class _OfResult(IdmeshError):
    """Of a result that may not be used."""

    result: Result
    """The result; None if the exception comes from another process, or from a product."""

    def __init__(self, *args: object) -> None:
        super().__init__(*args)
        self.result = None  # type: ignore[assignment]


class NotConverged(_OfResult):
    """A relaxation ran out of sweeps (exit code 4)."""


class InvalidMesh(_OfResult):
    """The moved mesh is not valid: for example inverted cells remain (exit code 5)."""


class DeviceError(IdmeshError, RuntimeError):
    """There is no usable GPU, or the GPU failed (exit code 6)."""


class NotDifferentiable(IdmeshError):
    """The result has no derivative: it was not made by springs in one jump, or a family's stage has no products."""
