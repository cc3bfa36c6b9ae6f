"""solidtex.transport beside exact laws: slits, ducts, tubes, slabs and a direct solver."""

import math

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from solidtex import transport
from solidtex.errors import InvalidArgument


def along(section: np.ndarray, axis: int, length: int) -> np.ndarray:
    """A channel of a cross-section along an axis."""
    return np.moveaxis(np.repeat(section[None], length, 0), 0, axis)


def framed(pores: np.ndarray) -> np.ndarray:
    return np.pad(pores, 1)


def disk(radius: float) -> np.ndarray:
    side = 2 * math.ceil(radius) + 3
    at = np.arange(side) - (side - 1) / 2
    return np.hypot(*np.meshgrid(at, at)) < radius


def duct_flow(a: int, b: int) -> float:
    """Permeability times area of a duct (White, Viscous fluid flow)."""
    terms = sum(math.tanh(n * math.pi * b / 2 / a) / n**5 for n in range(1, 200, 2))
    return a**3 * b / 12 * (1 - 192 * a / math.pi**5 / b * terms)


@pytest.mark.parametrize("width", [1, 2, 5, 10])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_slits_of_any_width_have_the_exact_flow(width: int, axis: int) -> None:
    section = np.zeros((width + 2, 3), bool)
    section[1:-1] = True
    found = transport.permeability(along(section, axis, 4), axis, "periodic")
    assert found.has_converged
    assert found.value == pytest.approx(width**3 / 12 / (width + 2), rel=5e-3)


@pytest.mark.parametrize(("a", "b"), [(6, 6), (8, 12)])
def test_ducts_have_the_flow_of_the_series(a: int, b: int) -> None:
    pores = along(framed(np.ones((a, b), bool)), 0, 4)
    found = transport.permeability(pores, 0, "periodic")
    assert found.value == pytest.approx(duct_flow(a, b) / (a + 2) / (b + 2), rel=0.02)


@pytest.mark.parametrize("radius", [12, 17.3])
def test_tubes_have_the_flow_of_poiseuille(radius: float) -> None:
    section = disk(radius)
    found = transport.permeability(along(section, 2, 3), 2, "periodic")
    area = np.count_nonzero(section)  # of the disk as voxels have it
    assert found.value == pytest.approx(area**2 / (8 * math.pi) / section.size, rel=0.02)


@pytest.mark.parametrize(("period", "width"), [(16, 6), (24, 12)])
def test_slits_at_45_degrees_have_the_exact_flow(period: int, width: int) -> None:
    x, y = np.ogrid[:period, :period]
    pores = np.repeat(((x - y) % period < width)[:, :, None], 2, 2)
    exact = (width**2 / 2) / 12 * width / period  # voxels of the diagonal are sqrt(1/2) apart
    for axis, share in ((0, 0.5), (2, 1)):  # obliquely to the axis, and along z
        found = transport.permeability(pores, axis, "periodic")
        assert found.value == pytest.approx(share * exact, rel=0.02)


def test_a_long_volume_runs_until_its_pressure_has_settled() -> None:
    """A run that ends when the value hardly changes would be 33 % too high here."""
    noise = np.random.default_rng(5).standard_normal((160, 16, 16))
    smooth = ndimage.gaussian_filter(noise, 1.5, mode="wrap")
    pores = smooth > np.quantile(smooth, 0.62)
    found = transport.permeability(pores, 0, threads=1)
    settled = transport.permeability(pores, 0, tolerance=1e-4, threads=1)
    assert found.has_converged and settled.has_converged
    assert found.value == pytest.approx(settled.value, rel=0.01)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("length", [1, 8, 60])
def test_an_open_channel_has_its_flow_at_any_length(axis: int, length: int) -> None:
    pores = along(framed(np.ones((6, 6), bool)), axis, length)
    found = transport.permeability(pores, axis)
    periodic = transport.permeability(pores, axis, "periodic")
    assert found.value == pytest.approx(periodic.value, rel=2e-3)
    assert found.conducting_voxels == 36 * length


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_volume_and_its_mirror_image_together_conduct_alike(axis: int) -> None:
    """The pressure is constant on the plane between them, as it is on an open face."""
    smooth = ndimage.gaussian_filter(np.random.default_rng(7).standard_normal((20, 18, 16)), 1.5)
    pores = smooth > np.median(smooth)
    both = np.concatenate([pores, np.flip(pores, axis)], axis)
    found = transport.permeability(pores, axis, tolerance=1e-4)
    doubled = transport.permeability(both, axis, tolerance=1e-4)
    assert found.value == pytest.approx(doubled.value, rel=1e-3)
    sealed = np.pad(both, [(0, 0) if k == axis else (1, 1) for k in range(3)])
    periodic = transport.permeability(sealed, axis, "periodic", tolerance=1e-4)
    assert found.value == pytest.approx(periodic.value * sealed.size / both.size, rel=1e-3)


def test_viscosity_and_threads_change_the_flow_little_and_not_at_all() -> None:
    pores = np.random.default_rng(1).random((20, 16, 18)) < 0.7
    first = transport.permeability(pores, 0, threads=1)
    assert transport.permeability(pores, 0, threads=2) == first
    other = transport.permeability(pores, 0, viscosity=0.2, tolerance=1e-3)
    assert other.value == pytest.approx(first.value, rel=0.01)


def test_a_permeability_scales_with_the_square_of_the_voxels() -> None:
    section = framed(np.ones((4, 4), bool))
    coarse = transport.permeability(along(section, 0, 4), 0, "periodic").value
    refined = transport.permeability(along(section, 0, 4), 0, "periodic", refinement=2)
    assert refined.conducting_voxels == 16 * 4
    assert refined.value == pytest.approx(duct_flow(4, 4) / 36, rel=0.01)
    fine = np.kron(section, np.ones((3, 3), bool))
    assert transport.permeability(along(fine, 0, 4), 0, "periodic").value == pytest.approx(
        9 * coarse, rel=0.03
    )


def test_diffusion_along_slabs_and_across_them() -> None:
    slabs = np.zeros((12, 8, 8), bool)
    slabs[:, 2:5] = True
    for boundary in transport.BOUNDARIES:
        found = transport.diffusivity(slabs, 0, boundary)
        assert found.value == pytest.approx(3 / 8, rel=1e-6)
        across = transport.diffusivity(slabs, 1, boundary)
        assert across.value == 0 and across.conducting_voxels == 0 and across.has_converged


@pytest.mark.parametrize("boundary", transport.BOUNDARIES)
def test_diffusion_has_the_values_of_a_direct_solver(boundary: transport.Boundary) -> None:
    pores = np.random.default_rng(3).random((9, 7, 8)) < 0.75
    for axis in range(3):
        found = transport.diffusivity(pores, axis, boundary, tolerance=1e-10)
        assert found.value == pytest.approx(direct_diffusivity(pores, axis, boundary), rel=1e-6)


def direct_diffusivity(pores: np.ndarray, axis: int, boundary: str) -> float:
    """Solve all pores at once. Those that conduct nothing are held at zero."""
    length = pores.shape[axis]
    number = np.arange(pores.size).reshape(pores.shape)
    matrix = sparse.lil_matrix((pores.size, pores.size))
    right = np.zeros(pores.size)
    links = []  # (from, to or -1, conductance, drop between them)
    for at in np.argwhere(pores):
        for k in range(3):
            after = at.copy()
            after[k] += 1
            wraps = after[k] == pores.shape[k]
            after[k] %= pores.shape[k]
            if (wraps and boundary == "open") or not pores[tuple(after)]:
                continue
            links.append((number[tuple(at)], number[tuple(after)], 1, float(wraps and k == axis)))
    for a, b, conductance, drop in links:
        for here, there, sign in ((a, b, -1), (b, a, 1)):
            matrix[here, here] += conductance
            matrix[here, there] -= conductance
            right[here] += sign * drop
    inlet = np.zeros(pores.shape, bool)
    if boundary == "open":
        for end, value in ((0, 1.0), (length - 1, 0.0)):
            face = np.take(number, end, axis)[np.take(pores, end, axis)]
            for here in face.reshape(-1):
                matrix[here, here] += 2
                right[here] += 2 * value
                inlet.reshape(-1)[here] |= end == 0
    matrix += sparse.identity(pores.size) * 1e-12
    x = spsolve(matrix.tocsr(), right)
    if boundary == "open":
        flux = sum(2 * (1 - x[number[tuple(at)]]) for at in np.argwhere(inlet))
    else:
        across = [np.unravel_index(n, pores.shape)[axis] for a, b, *_ in links for n in (a, b)]
        moves = np.array(across).reshape(-1, 2)
        flows = np.array([x[a] - x[b] + drop for a, b, _, drop in links])
        flux = flows[moves[:, 0] != moves[:, 1]].sum() / length
    return float(flux) * length / (pores.size / length)


def test_conducting_fraction_by_direction() -> None:
    pores = np.zeros((6, 6, 6), bool)
    pores[:, 1, 1] = True
    pores[2, 3:5, 4] = True  # touches no end
    assert transport.conducting_fraction(pores, 0) == pytest.approx(6 / 8)
    assert transport.conducting_fraction(pores, 1) == 0
    assert transport.conducting_fraction(np.zeros((3, 3, 3), bool), 1) == 0


def test_a_periodic_path_must_reach_its_own_copy() -> None:
    stairs = np.zeros((4, 4, 4), bool)
    for i in range(4):
        stairs[i, i, 0] = stairs[(i + 1) % 4, i, 0] = True
    assert transport.conducting_fraction(stairs, 0, "periodic") == 1
    assert transport.conducting_fraction(stairs, 2, "periodic") == 0
    broken = stairs.copy()
    broken[3, 3, 0] = False
    assert transport.conducting_fraction(broken, 0, "periodic") == 0
    assert transport.permeability(broken, 0, "periodic").value == 0


def test_pores_that_touch_at_edges_alone_do_not_conduct() -> None:
    pores = np.zeros((2, 2, 1), bool)
    pores[0, 0, 0] = pores[1, 1, 0] = True
    assert transport.permeability(pores, 0).value == 0


def test_a_run_out_of_steps_says_so() -> None:
    pores = np.ones((6, 6, 6), bool)
    assert not transport.permeability(pores, 0, max_steps=50).has_converged


def test_an_exception_in_the_report_ends_the_run() -> None:
    def stop(steps: int, value: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        transport.permeability(np.ones((6, 6, 6), bool), 0, report=stop)


@pytest.mark.parametrize(
    ("pores", "arguments", "message"),
    [
        (np.ones((3, 3, 3)), {}, "pores: found float64 of shape (3, 3, 3), expected bool"),
        (np.ones((3, 3), bool), {}, "pores: found bool of shape (3, 3), expected bool"),
        (np.ones((3, 0, 3), bool), {}, "pores: found bool of shape (3, 0, 3), expected bool"),
        (np.ones((3, 3, 3), bool), {"axis": 3}, "axis: found 3, expected 0, 1 or 2"),
        (np.ones((3, 3, 3), bool), {"boundary": "open wide"}, "boundary: found 'open wide'"),
        (np.ones((3, 3, 3), bool), {"refinement": 0}, "refinement: found 0, expected 1 or more"),
        (np.ones((3, 3, 3), bool), {"viscosity": math.nan}, "viscosity: found nan, expected"),
    ],
)
def test_bad_arguments(pores: np.ndarray, arguments: dict, message: str) -> None:
    with pytest.raises(InvalidArgument) as caught:
        transport.permeability(pores, **{"axis": 0, **arguments})
    assert str(caught.value).startswith(message)
