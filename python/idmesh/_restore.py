"""Makes a pickled Mover again.

A task queue pickles a mover once for each task. A process that gets the same mover again takes the one it has, as long
as no file of the mover has changed.
"""

from __future__ import annotations

import os
import pickle
import threading
from collections import OrderedDict
from typing import Any

from ._idmesh import Mover

_MOST = 4
_lock = threading.Lock()
_kept: OrderedDict[bytes, tuple[Mover, list[tuple[int, int]]]] = OrderedDict()


def _stamps(mover: Mover) -> list[tuple[int, int]]:
    paths = []
    for path in mover.inputs:
        # The mesh of an OpenFOAM case is a folder.
        paths += sorted(path.iterdir()) if path.is_dir() else [path]
    stats = [os.stat(path) for path in paths]
    return [(stat.st_mtime_ns, stat.st_size) for stat in stats]


def _make(make: str, path: str, keywords: dict[str, Any]) -> Mover:
    return Mover.from_case(path, **keywords) if make == "case" else Mover(path, **keywords)


def restore(make: str, path: str, keywords: dict[str, Any], starts_from_last: bool) -> Mover:
    """The mover with these arguments."""
    if starts_from_last:
        # Its results depend on earlier designs, so nobody shares it.
        mover = _make(make, path, keywords)
        mover.start_from("last")
        return mover
    key = pickle.dumps((os.getpid(), make, path, keywords))
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
        mover = _make(make, path, keywords)
        _kept[key] = mover, _stamps(mover)
        while len(_kept) > _MOST:
            _kept.popitem(last=False)
        return mover
