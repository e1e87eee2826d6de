"""Work that several processes do together."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any, TypeVar

from ._errors import IdmeshError

T = TypeVar("T")


class Processes:
    """The processes of a communicator of mpi4py, or this one alone. The first process does the work."""

    def __init__(self, comm: Any) -> None:
        self.comm = comm if comm is not None and comm.size > 1 else None
        self.size: int = 1 if self.comm is None else self.comm.size
        self.is_first: bool = self.comm is None or self.comm.rank == 0

    def together(self, work: Callable[[], T]) -> T:
        """Each process's own work. What it raises on one process is raised on all."""
        if self.comm is None:
            return work()
        try:
            value, error = work(), None
        except Exception as caught:  # noqa: BLE001
            value, error = None, caught
        errors = self.comm.allgather(_sent(error))
        if error is not None:
            raise error
        for rank, other in enumerate(errors):
            if other is not None:
                other.args = (f"on process {rank}: {other}",)
                raise other
        return value  # type: ignore[return-value]

    def of_first(self, work: Callable[[], T], sends: bool = True) -> T:
        """The first process's work. All get its value, if it is sent, and what it raises."""
        if self.comm is None:
            return work()
        value, error = None, None
        if self.is_first:
            try:
                value = work()
            except Exception as caught:  # noqa: BLE001
                error = caught
        told, sent = self.comm.bcast((_sent(error), value if sends else None))
        if error is not None:
            raise error
        if told is not None:
            raise told
        return value if self.is_first else sent  # type: ignore[return-value]

    def gather(self, value: T) -> list[T] | None:
        """All processes' values, on the first process."""
        if self.comm is None:
            return [value]
        return self.comm.gather(value)  # type: ignore[no-any-return]

    def scatter(self, values: list[T] | None) -> T:
        """Each process's part of the first process's list."""
        if self.comm is None:
            assert values is not None
            return values[0]
        return self.comm.scatter(values if self.is_first else None)  # type: ignore[no-any-return]

    def share(self, value: T) -> T:
        """The first process's value."""
        return value if self.comm is None else self.comm.bcast(value)

    def sum_of(self, value: float) -> float:
        """The sum over all processes."""
        return value if self.comm is None else self.comm.allreduce(value)

    def before(self, count: int) -> int:
        """The sum over the processes before this one."""
        return 0 if self.comm is None else sum(self.comm.allgather(count)[: self.comm.rank])


def _sent(error: Exception | None) -> Exception | None:
    """An exception that can be sent to another process."""
    if error is None:
        return None
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001
        return IdmeshError(f"{type(error).__name__}: {error}")
    return error
