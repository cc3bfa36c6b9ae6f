#!/usr/bin/env python3
"""Figures of a binary volume by solidtex beside those of PoreSpy, TauFactor and lbmpy.

    pip install porespy taufactor lbmpy
    python benchmarks/measure_peers.py berea-200.npz --size 100 --axis x  # minutes

The volume is a file as for permeability.py; --size takes a corner of it. Lengths are in voxels.
lbmpy compiles a lattice-Boltzmann method with the two relaxation times of solidtex.transport. It
has no faces that hold a pressure: a body force drives the flow through the volume and its mirror
image, again and again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from permeability import read_pores, row

from solidtex import transport
from solidtex_export.measuring import geometry

DISTANCE = 4.0  # of the two-point probability
FORCE = 1e-6
STEPS = 250  # between looks at the flow
VISCOSITY = 0.1
MAGIC = 1 / 8  # product of the relaxation times


def compare(figure: str, ours: float, theirs: float, by: str) -> None:
    row(figure, float(ours), float(theirs), by, f"{ours / theirs:.4f}" if theirs else "")


def geometry_rows(pores: np.ndarray, axis: int) -> None:
    import porespy
    from skimage.measure import euler_number, marching_cubes, mesh_surface_area

    compare("porosity", pores.mean(), porespy.metrics.porosity(pores), "PoreSpy")
    euler = euler_number(pores, connectivity=1)
    compare("Euler characteristic", geometry.euler_characteristic(pores), euler, "scikit-image")
    area = mesh_surface_area(*marching_cubes(pores.astype(np.float32), 0.5)[:2])
    ours = geometry.specific_surface(pores)
    compare("specific surface", ours, area / pores.size, "scikit-image, marching cubes")
    chords = porespy.filters.apply_chords(pores, axis=axis, spacing=1, trim_edges=True)
    lengths = porespy.metrics.chord_counts(chords)
    compare("mean chord", geometry.chords(pores, axis).mean(), lengths.mean(), "PoreSpy")
    found = porespy.metrics.two_point_correlation(pores, bins=np.arange(0.5, 12))
    theirs = np.interp(DISTANCE, found.distance, found.probability) * pores.mean()
    ours = np.mean([geometry.two_point(pores, a)[int(DISTANCE)] for a in range(3)])
    compare(f"S2 at {DISTANCE:g}, all directions", ours, theirs, "PoreSpy")
    radii, covered = geometry.pore_sizes(pores)
    whole = list(range(1, int(max(radii)) + 1))  # the radii that PoreSpy takes
    sizes = porespy.filters.local_thickness(pores, sizes=whole)
    ours = geometry.mean_radius(whole, list(np.interp(whole, radii, covered)))
    compare("mean pore radius, whole voxels", ours, sizes[pores].mean(), "PoreSpy")


def tortuosity_row(pores: np.ndarray, axis: int) -> None:
    import taufactor

    solver = taufactor.Solver(np.moveaxis(pores, axis, 0).astype(np.uint8), device="cpu")
    solver.solve(verbose=False)
    ours = pores.mean() / transport.diffusivity(pores, axis).value
    compare("tortuosity", ours, np.squeeze(solver.tau).item(), "TauFactor")


def permeability_row(pores: np.ndarray, axis: int) -> None:
    ours = transport.permeability(pores, axis, tolerance=1e-3).value
    compare("permeability", ours, lbmpy_permeability(pores, axis), "lbmpy")


def lbmpy_permeability(pores: np.ndarray, axis: int) -> float:
    """Permeability in voxels squared between two faces that hold a pressure, other faces sealed."""
    from lbmpy import ForceModel, LBMConfig, LBStencil, Method, Stencil
    from lbmpy.boundaries import NoSlip
    from lbmpy.lbstep import LatticeBoltzmannStep

    along = np.moveaxis(pores, axis, 0)
    mirrored = np.pad(np.concatenate([along, along[::-1]]), ((0, 0), (1, 1), (1, 1)))
    tau = 3 * VISCOSITY
    method = LBMConfig(
        stencil=LBStencil(Stencil.D3Q19),
        method=Method.TRT,
        relaxation_rates=[1 / (tau + 0.5), 1 / (MAGIC / tau + 0.5)],
        force=(FORCE, 0, 0),
        force_model=ForceModel.GUO,
        compressible=False,
    )
    flow = LatticeBoltzmannStep(mirrored.shape, periodicity=(True,) * 3, lbm_config=method)

    def is_solid(*centers: np.ndarray) -> np.ndarray:
        voxels = [np.floor(c).astype(int) % n for c, n in zip(centers, mirrored.shape, strict=True)]
        return ~mirrored[tuple(voxels)]

    flow.boundary_handling.set_boundary(NoSlip(), mask_callback=is_solid)
    before = 0.0
    while True:
        flow.run(STEPS)
        # The populations are those after a collision, which adds the force once more.
        velocity = np.where(mirrored, np.nan_to_num(flow.velocity[:, :, :, 0]) - FORCE, 0)
        found = VISCOSITY * velocity.sum() / FORCE / (2 * pores.size)
        if abs(found - before) < 1e-4 * abs(found):
            return float(found)
        before = found


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("volume", type=Path, help="binary volume: .npz, .tif or a .zip of it")
    p.add_argument("--size", type=int, default=100, help="side of the corner (default: 100)")
    p.add_argument("--axis", choices="xyz", default="x", help="default: x")
    args = p.parse_args()
    corner = np.ascontiguousarray(read_pores(args.volume)[(slice(args.size),) * 3])
    axis = "xyz".index(args.axis)
    row("figure", "solidtex", "other", "by", "ratio")
    row(*["---"] * 5)
    geometry_rows(corner, axis)
    tortuosity_row(corner, axis)
    permeability_row(corner, axis)


if __name__ == "__main__":
    main()
