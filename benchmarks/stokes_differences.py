"""Permeability of a corner of a volume by two methods: solidtex.transport, and finite differences.

    python benchmarks/stokes_differences.py berea-200.npz --size 72 --axes xz  # minutes

Finite differences of the Stokes equations on the staggered grid of Harlow and Welch 1965: pressures
in the middles of voxels, velocities on their faces. Conjugate gradients on the pressure solve them
(the Schur complement). Boundaries are those of solidtex.transport: pressures of 1 and 0 on the two
faces across the axis, the other faces sealed. The volume is a file as for permeability.py.
"""

import argparse
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from permeability import millidarcy_per_square, read_pores, row
from scipy import ndimage, sparse
from scipy.sparse.linalg import LinearOperator, cg

from solidtex import transport

WALL = 2.0  # a wall is half a voxel from a velocity along it
STAIR = 1.5  # half of a control volume's side is wall, half a face that nothing flows through
OUTSIDE = -2


@dataclass
class Component:
    """Velocities across faces of one axis that lie between two pores.

    `faces` [x, y, z]: index of each, or -1. `friction` [face, face]: minus the Laplacian.
    `divergence` [pore, face].
    """

    faces: np.ndarray
    friction: sparse.csr_matrix
    divergence: sparse.csr_matrix

    @cached_property
    def _preconditioner(self) -> sparse.dia_matrix:
        return sparse.diags(1 / self.friction.diagonal())

    def solve(self, force: np.ndarray) -> np.ndarray:
        """The velocities by which friction is equal to the force."""
        found, failed = cg(self.friction, force, rtol=1e-7, M=self._preconditioner)
        assert not failed
        return found


def numbered(mask: np.ndarray) -> np.ndarray:
    numbers = np.full(mask.shape, -1)
    numbers[mask] = np.arange(np.count_nonzero(mask))
    return numbers


def neighbors(values: np.ndarray, axis: int, step: int, outside: int) -> np.ndarray:
    """The value of the next element along an axis, in the direction of the step."""
    pads = [(int(a == axis and step < 0), int(a == axis and step > 0)) for a in range(3)]
    padded = np.pad(values, pads, constant_values=outside)
    first = int(step > 0)
    return np.take(padded, range(first, first + values.shape[axis]), axis)


def component(pores: np.ndarray, axis: int, stair: float) -> Component:
    """Velocities along `axis` of a flow along axis 0."""
    ends = tuple((int(a == axis), int(a == axis)) for a in range(3))
    padded = np.pad(pores, ends, mode="edge") if axis == 0 else np.pad(pores, ends)
    size = pores.shape[axis]
    before, after = (np.take(padded, range(i, i + size + 1), axis).astype(int) for i in (0, 1))
    sides = before + after
    faces = numbered(sides == 2)
    first, last = (np.take(faces, range(i, i + size), axis)[pores] for i in (0, 1))
    cells = np.arange(len(first))
    enters, leaves = first >= 0, last >= 0
    signs = np.repeat([-1.0, 1.0], [enters.sum(), leaves.sum()])
    where = (np.r_[cells[enters], cells[leaves]], np.r_[first[enters], last[leaves]])
    divergence = sparse.csr_matrix((signs, where), (len(cells), faces.max() + 1))
    return Component(faces, friction(faces, sides, axis, stair), divergence)


def friction(faces: np.ndarray, sides: np.ndarray, axis: int, stair: float) -> sparse.csr_matrix:
    """`sides`: the number of pores beside each face, 0 to 2."""
    free = faces >= 0
    volume = np.ones(faces.shape)
    if axis == 0:
        volume[[0, -1]] = 0.5  # control volumes of the open faces
    at, share = faces[free], volume[free]
    diagonal = np.zeros(len(at))
    rows, columns, entries = [at], [at], [diagonal]
    for along in range(3):
        for step in (1, -1):
            other = neighbors(faces, along, step, OUTSIDE)[free]
            found = other >= 0
            if along == axis:
                weight = np.where(other == OUTSIDE, 0.0, 1.0)
            else:
                beside = neighbors(sides, along, step, 0)[free]
                weight = np.where(found, 1.0, np.where(beside == 0, WALL, stair)) * share
            diagonal += weight
            rows.append(at[found])
            columns.append(other[found])
            entries.append(-weight[found])
    triples = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_matrix(triples, (len(at), len(at)))


def permeability(pores: np.ndarray, axis: int, stair: float = STAIR) -> tuple[float, float]:
    """Permeability in voxels squared, and the relative range of the flow through three layers."""
    pores = np.moveaxis(connected(pores, axis), axis, 0)
    parts = [component(pores, a, stair) for a in range(3)]
    flow = parts[0]
    force = np.zeros(flow.friction.shape[0])
    force[flow.faces[0][flow.faces[0] >= 0]] = 1  # the pressure on the first face

    def schur(pressure: np.ndarray) -> np.ndarray:
        return sum(p.divergence @ p.solve(p.divergence.T @ pressure) for p in parts)

    count = np.count_nonzero(pores)
    operator = LinearOperator((count, count), matvec=schur, dtype=float)
    pressure, failed = cg(operator, -flow.divergence @ flow.solve(force), rtol=1e-4)
    assert not failed
    velocity = flow.solve(force + flow.divergence.T @ pressure)
    length, *section = pores.shape
    layers = [flow.faces[i] for i in (0, length // 2, length)]
    through = [velocity[layer[layer >= 0]].sum() * length / np.prod(section) for layer in layers]
    return float(np.mean(through)), float(np.ptp(through) / np.mean(through))


def connected(pores: np.ndarray, axis: int) -> np.ndarray:
    """The pores that reach both faces across the axis."""
    labels, _ = ndimage.label(pores)
    first, last = (np.unique(np.take(labels, end, axis)) for end in (0, -1))
    return np.isin(labels, np.setdiff1d(np.intersect1d(first, last), 0))


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("volume", type=Path, help="binary volume: .npz, .tif or a .zip of it")
    p.add_argument("--size", type=int, default=72, help="side of the corner (default: 72)")
    p.add_argument("--axes", default="xyz", help="default: xyz")
    p.add_argument("--voxel-size", type=float, default=5.345, metavar="UM",
                   help="in micrometers (default: 5.345)")  # fmt: skip
    p.add_argument("--stair", type=float, default=STAIR, metavar="F",
                   help="friction at the rise of a stair, from 1 to 2 (default: 1.5)")  # fmt: skip
    args = p.parse_args()
    corner = np.ascontiguousarray(read_pores(args.volume)[(slice(args.size),) * 3])
    millidarcy = millidarcy_per_square(args.voxel_size)
    row("axis", "lattice-Boltzmann, mD", "differences, mD", "ratio", "range", "CPU seconds")
    row(*["---"] * 6)
    for name in args.axes:
        axis = "xyz".index(name)
        ours = transport.permeability(corner, axis, tolerance=1e-3).value
        begin = time.process_time()
        theirs, spread = permeability(corner, axis, args.stair)
        seconds = f"{time.process_time() - begin:.0f}"
        row(name, ours * millidarcy, theirs * millidarcy, ours / theirs, spread, seconds)


if __name__ == "__main__":
    main()
