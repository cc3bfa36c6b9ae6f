"""Spatially seeded noise (docs/noise.md) in NumPy: Python's definition of both schemes.

A value is a pure function of (seed, level, channel, x, y, z). Coordinates are integer arrays that
broadcast and are taken modulo 2^32. Integers below are unsigned and wrap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch

Array = np.ndarray

GOLDEN = 0x9E3779B97F4A7C15
MASK64 = (1 << 64) - 1
PERIOD = 65536  # of the solidtexturenets scheme


def uniform(
    scheme: str, seed: int, level: int, channel: int, x: Array, y: Array, z: Array
) -> Array:
    """Values in [0, 1) (solidtexturenets can round to 1), exact in float32, as float64."""
    return _SCHEMES[scheme](seed, level, channel, *_wrapped(x, y, z))


def normal(scheme: str, seed: int, level: int, channel: int, x: Array, y: Array, z: Array) -> Array:
    """Standard normal values in float64."""
    if scheme != "solidtex-1":
        raise ValueError(f'noise scheme: found {scheme!r} for "normal", expected "solidtex-1"')
    u = solidtex_1_bits(seed, level, channel, *_wrapped(x, y, z))
    p = ((u & np.uint32(0x7FFFFFFF)).astype(np.float64) + 0.5) * 2.0**-32
    tail = -torch.special.ndtri(torch.from_numpy(np.atleast_1d(p))).numpy().reshape(p.shape)
    return np.where(u >> 31 == 0, -tail, tail)


DISTRIBUTIONS: dict[str, Callable[..., Array]] = {"uniform": uniform, "normal": normal}


def block(
    scheme: str,
    distribution: str,
    seed: int,
    level: int,
    channels: int,
    lo: Sequence[int],
    hi: Sequence[int],
) -> Array:
    """The noise of a box, lo inclusive, hi exclusive: float64 [channel, x, y, z]."""
    axes = [np.arange(l, h, dtype=np.int64) for l, h in zip(lo, hi, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij", sparse=True)
    draw = DISTRIBUTIONS[distribution]
    return np.stack([draw(scheme, seed, level, channel, *grid) for channel in range(channels)])


def waves(waves: Sequence[Sequence[int]], lo: Sequence[int], hi: Sequence[int]) -> Array:
    """Sines of a box, one for each wave [f_x, f_y, f_z, phase] in 2^-32 turns: float64
    [channel, x, y, z].
    """
    axes = [np.arange(l, h, dtype=np.int64) for l, h in zip(lo, hi, strict=True)]
    grid = np.meshgrid(*axes, indexing="ij")
    return np.stack([_wave(wave, *_wrapped(*grid)) for wave in waves])


def _wave(wave: Sequence[int], x: Array, y: Array, z: Array) -> Array:
    a, b, c, phase = (np.uint32(number) for number in wave)
    return np.sin(2 * np.pi * (a * x + b * y + c * z + phase).astype(np.float64) * 2.0**-32)


def _wrapped(*coordinates: Array) -> list[Array]:
    return [np.asarray(c).astype(np.int64).astype(np.uint32) for c in coordinates]


def _mix64(value: int) -> int:
    """The finalizer of SplitMix64."""
    z = value & MASK64
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK64
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK64
    return z ^ (z >> 31)


def solidtex_1_key(seed: int, level: int, channel: int) -> list[np.uint32]:
    h = _mix64(_mix64(seed + GOLDEN) + ((level << 32) | channel) + GOLDEN)
    k01, k23 = _mix64(h + GOLDEN), _mix64(h + 2 * GOLDEN)
    return [np.uint32(word & 0xFFFFFFFF) for word in (k01, k01 >> 32, k23, k23 >> 32)]


def solidtex_1_bits(seed: int, level: int, channel: int, x: Array, y: Array, z: Array) -> Array:
    key = solidtex_1_key(seed, level, channel)
    counter = (x, y, z, np.zeros((), np.uint32))
    words = [w ^ k for w, k in zip(counter, key, strict=True)]
    # Arrays, never scalars: NumPy warns of wrapping scalars only.
    words = [np.ascontiguousarray(w) for w in np.broadcast_arrays(*words)]
    words = [w * np.uint32(1664525) + np.uint32(1013904223) for w in words]
    words = [w ^ (w >> 16) for w in _stir(*words)]
    a, _, _, d = _stir(*words)
    t = a ^ (a << 11)
    return d ^ (d >> 19) ^ t ^ (t >> 8)


def _stir(a: Array, b: Array, c: Array, d: Array) -> list[Array]:
    a = a + b * d
    b = b + c * a
    c = c + a * b
    d = d + b * c
    return [a, b, c, d]


def _solidtex_1_uniform(seed: int, level: int, channel: int, x: Array, y: Array, z: Array) -> Array:
    u = solidtex_1_bits(seed, level, channel, x, y, z)
    return (u >> 8).astype(np.float64) * 2.0**-24


def _solidtexturenets(seed: int, level: int, channel: int, x: Array, y: Array, z: Array) -> Array:
    x, y, z = (np.atleast_1d(c).astype(np.uint64) % np.uint64(PERIOD) for c in (x, y, z))
    plane = (level % 5) * 15 * PERIOD**2 + (channel % 3) * 3 * PERIOD**2
    key = np.uint64(plane) + z * np.uint64(PERIOD**2) + y * np.uint64(PERIOD) + x
    key = np.where(key == 0, np.uint64(1), key)
    if seed != 0:
        key = key ^ np.uint64(_mix64(seed))
    key = _wang(key)
    key ^= key >> np.uint64(12)
    key ^= key << np.uint64(25)
    key ^= key >> np.uint64(27)
    key *= np.uint64(0x2545F4914F6CDD1D)
    return key.astype(np.float32).astype(np.float64) * 2.0**-64


def _wang(k: Array) -> Array:
    """Thomas Wang's 64-bit integer hash."""
    k = ~k + (k << np.uint64(21))
    k ^= k >> np.uint64(24)
    k = (k + (k << np.uint64(3))) + (k << np.uint64(8))
    k ^= k >> np.uint64(14)
    k = (k + (k << np.uint64(2))) + (k << np.uint64(4))
    k ^= k >> np.uint64(28)
    return k + (k << np.uint64(31))


_SCHEMES: dict[str, Callable[..., Array]] = {
    "solidtex-1": _solidtex_1_uniform,
    "solidtexturenets": _solidtexturenets,
}
