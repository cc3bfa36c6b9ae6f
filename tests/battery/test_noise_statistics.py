"""Spectra, correlations and moments of the noise. Streams are fixed, so no test is a lottery.

Limits are in standard deviations of what true randomness would give. Each statistic is also put to
something flawed, which it must find.
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

SIDE = 64
COUNT = SIDE**3
PROGRAM = Path(os.environ["SOLIDTEX_BUILD"]) / "tests" / "battery" / "noise_stream"


def run(*arguments: object) -> bytes:
    command = [str(PROGRAM), *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True).stdout


def cube(
    scheme: str, *, seed: int = 0, level: int = 0, channel: int = 0, order: str = "cube"
) -> np.ndarray:
    data = run("words", scheme, order, COUNT, seed, level, channel)
    return np.frombuffer(data, np.uint32).reshape(SIDE, SIDE, SIDE)


def centered(words: np.ndarray) -> np.ndarray:
    """Uniform with mean 0 and variance 1."""
    return ((words + 0.5) * 2.0**-32 - 0.5) * np.sqrt(12)


def spectrum_deviation(values: np.ndarray) -> float:
    """How far from flat, in standard deviations: the worst of shells, planes and single bins.

    For white noise of variance 1 each power is exponential with mean and deviation 1.
    """
    power = np.abs(np.fft.fftn(values)) ** 2 / values.size
    power.flat[0] = 1  # the mean has its own test
    frequency = np.fft.fftfreq(SIDE) * SIDE
    radius = np.sqrt(sum(f**2 for f in np.meshgrid(*[frequency] * values.ndim)))
    worst = 0.0
    for shell in range(1, SIDE // 2):
        inside = power[(radius >= shell) & (radius < shell + 1)]
        # Real data: bins come in conjugate pairs, half of them are independent.
        worst = max(worst, abs(inside.mean() - 1) * np.sqrt(inside.size / 2))
    for axis in range(values.ndim):
        plane = power.mean(axis=tuple(a for a in range(values.ndim) if a != axis))
        per_plane = power.size // SIDE
        worst = max(worst, float(np.abs(plane - 1).max()) * np.sqrt(per_plane / 2))
    # The largest of n exponentials is about log n; beyond it the odds fall as exp(-excess).
    excess = power.max() - np.log(power.size)
    return max(worst, np.sqrt(2 * max(excess, 0.0)))


def correlation_deviation(a: np.ndarray, b: np.ndarray, same: bool = False) -> float:
    """The largest correlation over all cyclic shifts, in standard deviations."""
    product = np.fft.ifftn(np.fft.fftn(a) * np.conj(np.fft.fftn(b))).real
    if same:
        product.flat[0] = 0
    return float(np.abs(product).max()) / np.sqrt(a.size)


LIMIT = 6.5  # one in 10^10 for one normal number; the searches look at up to 10^6


@pytest.mark.parametrize("order", ["cube", "stride"])
@pytest.mark.parametrize("seed", [0, 1, 2**63])
def test_spectra_are_flat(order: str, seed: int) -> None:
    values = centered(cube("solidtex-1", seed=seed, order=order))
    assert spectrum_deviation(values) < LIMIT
    for axis in range(3):
        for index in (0, SIDE // 2):
            assert spectrum_deviation(np.take(values, index, axis)) < LIMIT


@pytest.mark.parametrize("order", ["cube", "stride"])
def test_spectrum_of_every_bit_is_flat(order: str) -> None:
    words = cube("solidtex-1", order=order)
    for bit in range(32):
        assert spectrum_deviation((words >> bit & 1) * 2.0 - 1) < LIMIT, f"bit {bit}"


def test_the_spectrum_detects_colored_noise() -> None:
    values = centered(cube("solidtex-1"))
    assert spectrum_deviation(values + 0.1 * np.roll(values, 1, axis=2)) > LIMIT
    x, y, z = np.indices((SIDE,) * 3).astype(np.uint32)
    linear = x * np.uint32(1664525) + y * np.uint32(22695477) + z * np.uint32(1103515245)
    assert spectrum_deviation(centered(linear)) > 100


def test_streams_are_not_correlated_at_any_shift() -> None:
    base = centered(cube("solidtex-1"))
    assert correlation_deviation(base, base, same=True) < LIMIT
    others: list[dict] = [
        *({"channel": c} for c in (1, 2, 3)),
        *({"level": level} for level in (1, 2, 5, 10)),
        *({"seed": s} for s in (1, 2, 2**32, 2**63)),
    ]
    for other in others:
        assert correlation_deviation(base, centered(cube("solidtex-1", **other))) < LIMIT, other


@pytest.mark.parametrize("axes", [(1, 0, 2), (2, 1, 0), (0, 2, 1)])
def test_axes_are_not_correlated(axes: tuple[int, int, int]) -> None:
    base = centered(cube("solidtex-1"))
    first, second = (axis for axis in range(3) if axes[axis] != axis)
    # Two halves that swapping the axes maps onto one another, without a voxel in common.
    low_high, high_low = [slice(None)] * 3, [slice(None)] * 3
    low_high[first] = high_low[second] = slice(0, SIDE // 2)
    low_high[second] = high_low[first] = slice(SIDE // 2, SIDE)
    swapped = base[tuple(high_low)].transpose(axes)
    assert correlation_deviation(base[tuple(low_high)], swapped) < LIMIT
    symmetric = base + base.transpose(axes)  # and this is found
    swapped = symmetric[tuple(high_low)].transpose(axes)
    assert correlation_deviation(symmetric[tuple(low_high)], swapped) > 100


def test_correlation_finds_the_flaws_of_the_published_scheme() -> None:
    base = centered(cube("solidtexturenets"))
    assert correlation_deviation(base, centered(cube("solidtexturenets", channel=1))) > 100
    # Level 5 repeats level 0, and the levels between are shifted by 15 as well.
    assert correlation_deviation(base, centered(cube("solidtexturenets", level=5))) > 100
    assert correlation_deviation(base, centered(cube("solidtexturenets", level=1))) > 100


def moment_deviation(normals: np.ndarray) -> float:
    """The worst of mean, variance, skewness and kurtosis, in standard deviations."""
    n = normals.size
    found = [np.mean(normals**k) for k in (1, 2, 3, 4)]
    expected, variance = (0, 1, 0, 3), (1, 2, 15, 96)
    deviations = zip(found, expected, variance, strict=True)
    return max(abs(f - e) / np.sqrt(v / n) for f, e, v in deviations)


def kolmogorov(normals: np.ndarray) -> float:
    """D sqrt(n) of the Kolmogorov-Smirnov test; above 2.6 for one in 10^6."""
    ordered = ndtr(np.sort(normals))
    n = ordered.size
    steps = np.arange(n + 1) / n
    gap = max(np.abs(ordered - steps[:-1]).max(), np.abs(ordered - steps[1:]).max())
    return float(gap) * np.sqrt(n)


@pytest.mark.parametrize("order", ["x", "y", "z", "channel", "level", "seed", "cube", "stride"])
def test_normals_are_normal(order: str) -> None:
    data = run("normals", "solidtex-1", order, 1_000_000)
    normals = np.frombuffer(data, np.float32).astype(np.float64)
    assert moment_deviation(normals) < 5
    assert kolmogorov(normals) < 2.6


def test_the_normal_tests_detect_other_distributions() -> None:
    uniform = centered(cube("solidtex-1")).ravel()
    assert moment_deviation(uniform) > 50
    assert kolmogorov(uniform) > 10
    nearly = ndtri((cube("solidtex-1").ravel() + 0.5) * 2.0**-32) * 1.02
    assert moment_deviation(nearly) > 5


def quantile_error(first: int, step: int, count: int) -> np.ndarray:
    found = np.frombuffer(run("quantiles", first, step, count), np.float32).astype(np.float64)
    words = (first + np.arange(count, dtype=np.uint64) * np.uint64(step)) & np.uint64(0xFFFFFFFF)
    p = ((words & np.uint64(0x7FFFFFFF)) + 0.5) * 2.0**-32
    magnitude = -ndtri(p)
    return np.abs(found - np.where(words >> np.uint64(31), magnitude, -magnitude))


def test_normal_quantile_is_as_accurate_as_numerics_md_says() -> None:
    tail = quantile_error(0, 1, 1 << 20).max()
    spread = quantile_error(1, 2039, (1 << 32) // 2039).max()
    center = quantile_error(0xFFFFFFFF - (1 << 20), 1, 1 << 20).max()
    print(
        f"largest error of the normal quantile: tail {tail:.2e}, everywhere {spread:.2e}, "
        f"center {center:.2e}"
    )
    assert max(tail, spread, center) < 1.6e-6
    assert center < 2.5e-7
