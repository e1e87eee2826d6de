"""Makes a pickled Mover again.

A task queue pickles a mover once for each task. A process that gets the same mover again takes the one it has, as long
as no file of the mover has changed.
"""

from __future__ import annotations

import os
import pickle
import threading
import zlib
from collections import OrderedDict
from typing import Any

import numpy as np

from ._errors import InputError
from ._idmesh import Mover

_MOST = 4
_lock = threading.Lock()
_kept: OrderedDict[bytes, tuple[Mover, list[tuple[int, int]]]] = OrderedDict()


def _unlocked() -> None:
    """Another thread of the parent may have held the lock when this process was forked."""
    global _lock
    _lock = threading.Lock()
    _kept.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_unlocked)


def _sum(array: Any, found: int) -> int:
    return zlib.crc32(np.ascontiguousarray(array).data, found)


def fingerprint(mover: Mover) -> int:
    """A number that another mesh, and other profiles, hardly have."""
    found = 0
    for array in (mover.vertices, *mover.cells.values()):
        found = _sum(array, found)
    for profiles in (mover.old_profiles, mover.design.profiles):
        for wing in sorted(profiles):
            for number in sorted(profiles[wing]):
                found = _sum(profiles[wing][number], zlib.crc32(f"{wing} {number}".encode(), found))
    for family, displacement in sorted(mover.design.displacements.items()):
        found = _sum(displacement, zlib.crc32(family.encode(), found))
    return found


def _stamps(mover: Mover) -> list[tuple[int, int]]:
    paths = []
    for path in mover.inputs:
        # The mesh of an OpenFOAM case is a folder.
        paths += sorted(path.iterdir()) if path.is_dir() else [path]
    stats = [os.stat(path) for path in paths]
    return [(stat.st_mtime_ns, stat.st_size) for stat in stats]


def _make(make: str, path: str, keywords: dict[str, Any], expected: int) -> Mover:
    mover = Mover.from_case(path, **keywords) if make == "case" else Mover(path, **keywords)
    if fingerprint(mover) != expected:
        raise InputError(
            f"{os.fspath(path)}: the mesh, or a file of profiles or displacements, has changed since the mover was made, "
            "expected the same files where the mover is unpickled"
        )
    return mover


def copied(make: str, path: str, keywords: dict[str, Any], starts_from_last: bool, expected: int) -> Mover:
    """A mover with these arguments that nobody else has."""
    mover = _make(make, path, keywords, expected)
    if starts_from_last:
        mover.start_from("last")
    return mover


def restore(make: str, path: str, keywords: dict[str, Any], starts_from_last: bool, expected: int) -> Mover:
    """The mover with these arguments."""
    if starts_from_last:
        # Its results depend on earlier designs, so nobody shares it.
        return copied(make, path, keywords, starts_from_last, expected)
    key = pickle.dumps((os.getpid(), make, path, keywords, expected))
    with _lock:
        if key in _kept:
            mover, stamps = _kept.pop(key)
            try:
                same = _stamps(mover) == stamps and not mover.starts_from_last
            except OSError:
                same = False
            if same:
                _kept[key] = mover, stamps
                return mover
        mover = _make(make, path, keywords, expected)
        _kept[key] = mover, _stamps(mover)
        while len(_kept) > _MOST:
            _kept.popitem(last=False)
        return mover
