"""A design, and the derivative of a number by a design."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(eq=False)
class Design:
    """What a loop changes. Lengths are in the mesh's unit."""

    profiles: dict[str, dict[int, Floats]] = field(default_factory=dict)
    """New profiles of each wing by number: points (k, 3)."""
    displacements: dict[str, Floats] = field(default_factory=dict)
    """Displacements (k, 3) of each prescribed family, in the order of `Mover.family_vertices`."""


@dataclass(eq=False)
class Gradient:
    """The derivative of a number by a design, with the shapes of the design."""

    profiles: dict[str, dict[int, Floats]] = field(default_factory=dict)
    """By the points (k, 3) of each new profile, by wing and number."""
    displacements: dict[str, Floats] = field(default_factory=dict)
    """By the displacements (k, 3) of each prescribed family. A vertex of several counts for the last of them."""
