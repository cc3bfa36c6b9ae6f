"""Works out the test vectors of tests/unit/test_noise.cpp from docs/noise.md."""

GOLDEN = 0x9E3779B97F4A7C15
P = 65536


def u32(value: int) -> int:
    return value & 0xFFFFFFFF


def u64(value: int) -> int:
    return value & 0xFFFFFFFFFFFFFFFF


def mix64(z: int) -> int:
    z = u64((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9)
    z = u64((z ^ (z >> 27)) * 0x94D049BB133111EB)
    return z ^ (z >> 31)


def key_words(seed: int, level: int, channel: int) -> list[int]:
    h = mix64(u64(mix64(u64(seed + GOLDEN)) + ((level << 32) | channel) + GOLDEN))
    k01, k23 = mix64(u64(h + GOLDEN)), mix64(u64(h + 2 * GOLDEN))
    return [u32(k01), k01 >> 32, u32(k23), k23 >> 32]


def cross(a: int, b: int, c: int, d: int) -> tuple[int, int, int, int]:
    a = u32(a + b * d)
    b = u32(b + c * a)
    c = u32(c + a * b)
    return a, b, c, u32(d + b * c)


def solidtex_1(key: list[int], x: int, y: int, z: int) -> int:
    words = [
        u32((word ^ k) * 1664525 + 1013904223) for word, k in zip((x, y, z, 0), key, strict=True)
    ]
    words = [word ^ (word >> 16) for word in cross(*words)]
    a, _, _, d = cross(*words)
    t = u32(a ^ (a << 11))
    return d ^ (d >> 19) ^ t ^ (t >> 8)


def solidtexturenets(seed: int, level: int, channel: int, x: int, y: int, z: int) -> int:
    k = (level % 5) * 15 * P**2 + (channel % 3) * 3 * P**2
    k = k + (z % P) * P**2 + (y % P) * P + x % P or 1
    k ^= mix64(seed) if seed else 0
    k = u64(~k + (k << 21))
    k ^= k >> 24
    k = u64(k + (k << 3) + (k << 8))
    k ^= k >> 14
    k = u64(k + (k << 2) + (k << 4))
    k ^= k >> 28
    k = u64(k + (k << 31))
    k ^= k >> 12
    k = u64(k ^ (k << 25))
    k ^= k >> 27
    return u64(k * 0x2545F4914F6CDD1D)


if __name__ == "__main__":
    key = key_words(1, 2, 3)
    print("key", hex(key[0]), hex(key[3]))
    print("solidtex-1", hex(solidtex_1(key, 4, 5, 6)))
    print("solidtex-1", hex(solidtex_1(key_words(0, 0, 0), 0xFFFFFFFF, 0x80000000, 7)))
    print("solidtexturenets", hex(solidtexturenets(0, 6, 4, 70000, 0xFFFFFFFF, 3)))
    print("solidtexturenets", hex(solidtexturenets(0, 0, 0, 0, 0, 0)))
    print("solidtexturenets", hex(solidtexturenets(9, 1, 2, 3, 4, 5)))
