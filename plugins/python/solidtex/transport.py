"""Permeability, diffusivity and connectivity of the pores of a voxel image.

    import numpy as np
    from solidtex import transport

    pores = np.load("labels.npy") == 0
    flow = transport.permeability(pores, axis=2)
    print(flow.value * 2.25**2, "square micrometers, at voxels of 2.25 micrometers")

Values are in units of voxels: multiply a permeability by the square of the voxel size.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solidtex import _transport
from solidtex.errors import InvalidArgument

Boundary = Literal["open", "periodic"]
Report = Callable[[int, float], None]

BOUNDARIES = ("open", "periodic")


class Transport(NamedTuple):
    """Result of a solver."""

    value: float
    """Permeability in voxels squared, or diffusivity relative to that of the free pore fluid. 0
    if no path of pores leads along the axis."""
    conducting_voxels: int
    """Pore voxels connected to both ends of the axis."""
    steps: int
    """Steps of the solver."""
    has_converged: bool
    """False if the solver ran out of steps."""


def permeability(
    pores: ArrayLike,
    axis: int,
    boundary: Boundary = "open",
    *,
    tolerance: float = 5e-3,
    max_steps: int = 100_000,
    threads: int = 0,
    report: Report | None = None,
    viscosity: float | None = None,
    refinement: int = 1,
) -> Transport:
    """Return the permeability of the pores along an axis in voxels squared.

    A lattice-Boltzmann solver (D3Q19, two relaxation times) computes Stokes flow.

    pores: Array [x, y, z], true where a voxel is a pore.
    axis: 0, 1 or 2.
    boundary: "open" holds a pressure on the two faces across the axis and seals the others;
        "periodic" repeats the image on every axis.
    tolerance: Relative range of the value over the last third of the steps at which the run ends.
        The flow through the layers across the axis varies by at most twice as much.
    max_steps: The run ends here at the latest.
    threads: Number of threads, 0 for one per core.
    report: Called every 50 steps with the number of steps and the present value.
    viscosity: Of the lattice. Changes the number of steps, not the value. None chooses it by the
        width of the pores and the length of the image.
    refinement: Split each voxel into this many along each axis. Oblique walls become stairs with
        sharp edges, so that narrow channels conduct less than between smooth walls. Time and
        memory grow with its cube.
    """
    array, is_periodic = _checked(pores, axis, boundary)
    if viscosity is not None and not 0 < viscosity <= 10:
        raise InvalidArgument(f"viscosity: found {viscosity}, expected a number from 0 to 10")
    if refinement < 1:
        raise InvalidArgument(f"refinement: found {refinement}, expected 1 or more")
    for k in range(3):
        array = np.repeat(array, refinement, axis=k)
    found = _transport.permeability(
        array, axis, is_periodic, tolerance, max_steps, threads, report, viscosity or 0
    )
    value, conducting, steps, has_converged = found
    return Transport(value / refinement**2, conducting // refinement**3, steps, has_converged)


def diffusivity(
    pores: ArrayLike,
    axis: int,
    boundary: Boundary = "open",
    *,
    tolerance: float = 1e-6,
    max_steps: int = 100_000,
    threads: int = 0,
    report: Report | None = None,
) -> Transport:
    """Return the effective diffusivity along an axis, relative to that of the free pore fluid.

    Its inverse is the formation factor; the porosity divided by it is the tortuosity factor.
    Finite volumes on the faces between pores, solved by conjugate gradients.

    The arguments are those of permeability. `tolerance` is that of the residual.
    """
    array, is_periodic = _checked(pores, axis, boundary)
    found = _transport.diffusivity(array, axis, is_periodic, tolerance, max_steps, threads, report)
    return Transport(*found)


def conducting_fraction(pores: ArrayLike, axis: int, boundary: Boundary = "open") -> float:
    """Return the fraction of the pores that is connected, through faces, to both ends of an axis.

    With a periodic boundary: the fraction in components that reach their own copy in the next
    period.
    """
    array, is_periodic = _checked(pores, axis, boundary)
    total = int(np.count_nonzero(array))
    return _transport.count_conducting(array, axis, is_periodic) / total if total else 0.0


def _checked(pores: ArrayLike, axis: int, boundary: str) -> tuple[NDArray[np.uint8], bool]:
    array = np.asarray(pores)
    if array.ndim != 3 or array.dtype != np.bool_ or array.size == 0:
        raise InvalidArgument(
            f"pores: found {array.dtype} of shape {array.shape}, expected bool [x, y, z]"
        )
    if axis not in (0, 1, 2):
        raise InvalidArgument(f"axis: found {axis}, expected 0, 1 or 2")
    if boundary not in BOUNDARIES:
        raise InvalidArgument(f"boundary: found {boundary!r}, expected one of {BOUNDARIES}")
    return np.ascontiguousarray(array).view(np.uint8), boundary == "periodic"
