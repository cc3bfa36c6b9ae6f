"""Noise schemes against a transcription of docs/noise.md in plain integers, one value at a time."""

import math

import numpy as np
import pytest

from solidtex_export.export.verification import noise

M32, M64 = (1 << 32) - 1, (1 << 64) - 1
GOLDEN = 0x9E3779B97F4A7C15

RNG = np.random.default_rng(1)
COORDINATES = np.concatenate(
    [
        RNG.integers(-(2**31), 2**31, size=(200, 3)),
        RNG.integers(-3, 4, size=(50, 3)),
        [[0, 0, 0], [-1, 65535, 65536], [2**31 - 1, -(2**31), -65537], [2**30, -(2**30), 1]],
    ]
)


def mix64(z: int) -> int:
    z &= M64
    z ^= z >> 30
    z = z * 0xBF58476D1CE4E5B9 & M64
    z ^= z >> 27
    z = z * 0x94D049BB133111EB & M64
    return z ^ z >> 31


def solidtex_1_bits(seed: int, level: int, channel: int, x: int, y: int, z: int) -> int:
    h = mix64(mix64(seed + GOLDEN) + (level << 32 | channel) + GOLDEN)
    k01, k23 = mix64(h + GOLDEN), mix64(h + 2 * GOLDEN)
    words = [x & M32 ^ k01 & M32, y & M32 ^ k01 >> 32, z & M32 ^ k23 & M32, k23 >> 32]
    a, b, c, d = (word * 1664525 + 1013904223 & M32 for word in words)
    for last in (False, True):
        a = a + b * d & M32
        b = b + c * a & M32
        c = c + a * b & M32
        d = d + b * c & M32
        if not last:
            a, b, c, d = (word ^ word >> 16 for word in (a, b, c, d))
    t = a ^ a << 11 & M32
    return d ^ d >> 19 ^ t ^ t >> 8


def published(scale: int, channel: int, x: int, y: int, z: int) -> float:
    period = 65536
    k = (scale % 5) * 5 * 3 * period**2 + (channel % 3) * 3 * period**2
    k = (k + (z % period) * period**2 + (y % period) * period + x % period) & M64 or 1
    k = (~k + (k << 21)) & M64
    k ^= k >> 24
    k = (k + (k << 3) + (k << 8)) & M64
    k ^= k >> 14
    k = (k + (k << 2) + (k << 4)) & M64
    k ^= k >> 28
    k = (k + (k << 31)) & M64
    k ^= k >> 12
    k = k ^ k << 25 & M64
    k ^= k >> 27
    return float(np.float32(k * 0x2545F4914F6CDD1D & M64) / np.float32(M64))


@pytest.mark.parametrize(("seed", "level", "channel"), [(0, 0, 0), (7, 5, 2), (M64, 20, 4095)])
def test_solidtex_1_uniform(seed: int, level: int, channel: int) -> None:
    found = noise.uniform("solidtex-1", seed, level, channel, *COORDINATES.T)
    expected = [
        (solidtex_1_bits(seed, level, channel, *map(int, c)) >> 8) / 2**24 for c in COORDINATES
    ]
    np.testing.assert_array_equal(found, expected)


def test_solidtex_1_normal_inverts_the_distribution_function() -> None:
    found = noise.normal("solidtex-1", 3, 1, 2, *COORDINATES.T)
    for value, c in zip(found, COORDINATES, strict=True):
        u = solidtex_1_bits(3, 1, 2, *map(int, c))
        p = ((u & 0x7FFFFFFF) + 0.5) / 2**32
        assert math.erfc(abs(value) / math.sqrt(2)) / 2 == pytest.approx(p, rel=1e-12)
        assert (value < 0) == (u >> 31 == 0)


@pytest.mark.parametrize(("scale", "channel"), [(0, 0), (5, 0), (4, 2), (1, 3)])
def test_solidtexturenets_is_the_published_scheme(scale: int, channel: int) -> None:
    found = noise.uniform("solidtexturenets", 0, scale, channel, *COORDINATES.T)
    expected = [published(scale, channel, *map(int, c)) for c in COORDINATES]
    np.testing.assert_array_equal(found, expected)


def test_solidtexturenets_seeds_are_ours() -> None:
    published_values = noise.uniform("solidtexturenets", 0, 0, 0, *COORDINATES.T)
    seeded = noise.uniform("solidtexturenets", 1, 0, 0, *COORDINATES.T)
    assert np.abs(np.corrcoef(published_values, seeded)[0, 1]) < 0.25
    assert seeded.min() >= 0 and seeded.max() <= 1


def test_solidtexturenets_has_no_normal_values() -> None:
    with pytest.raises(ValueError, match="expected"):
        noise.normal("solidtexturenets", 0, 0, 0, *COORDINATES.T)


@pytest.mark.parametrize("scheme", ["solidtex-1", "solidtexturenets"])
def test_a_block_is_made_of_single_values(scheme: str) -> None:
    lo = (-3, 65534, -(2**30))
    values = noise.block(scheme, "uniform", 0, 2, 3, lo, (1, 65539, -(2**30) + 2))
    assert values.shape == (3, 4, 5, 2)
    for channel, i, j, k in [(0, 0, 0, 0), (1, 3, 4, 1), (2, 2, 1, 0)]:
        single = noise.uniform(
            scheme, 0, 2, channel, np.int64(lo[0] + i), np.int64(lo[1] + j), np.int64(lo[2] + k)
        )
        assert single.item() == values[channel, i, j, k]


def test_coordinates_wrap_at_two_to_the_32() -> None:
    once = noise.normal("solidtex-1", 0, 0, 0, *COORDINATES.T)
    np.testing.assert_array_equal(
        once, noise.normal("solidtex-1", 0, 0, 0, *(COORDINATES.T + 2**32))
    )


def test_moments() -> None:
    uniform = noise.block("solidtex-1", "uniform", 9, 0, 2, (0, 0, 0), (40, 40, 40))
    normal = noise.block("solidtex-1", "normal", 9, 0, 2, (0, 0, 0), (40, 40, 40))
    assert uniform.mean() == pytest.approx(0.5, abs=0.005)
    assert uniform.var() == pytest.approx(1 / 12, abs=0.002)
    assert normal.mean() == pytest.approx(0, abs=0.015)
    assert normal.var() == pytest.approx(1, abs=0.02)
    assert (normal**4).mean() == pytest.approx(3, abs=0.15)
