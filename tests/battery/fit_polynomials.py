"""Fits polynomials and prints them as C++: the engine's, for engine/kernels/polynomials.h, and the
path tracer's, for plugins/pathtracer/sampling/angles.h.

Every fit is minimax by Lawson's iteration: least squares on a Chebyshev grid whose weights are
multiplied by the error until the errors are level. Run it again and the same coefficients come out.
"""

import numpy as np
from scipy.special import ndtri_exp

GRID = 4000
ITERATIONS = 80


def chebyshev_grid(low: float, high: float) -> np.ndarray:
    nodes = np.cos(np.pi * (np.arange(GRID) + 0.5) / GRID)
    return (low + high) / 2 + (high - low) / 2 * nodes


def fit_rational(
    x: np.ndarray, y: np.ndarray, numerator: range, denominator: range, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """y = sum a_i x^i / (1 + sum b_j x^j); minimizes the largest |error| * scale."""
    powers_a = np.stack([x**i for i in numerator], axis=1)
    powers_b = np.stack([x**j for j in denominator], axis=1) if len(denominator) else None
    weight, bottom, best = np.ones_like(x), np.ones_like(x), None
    for _ in range(ITERATIONS):
        columns = powers_a if powers_b is None else np.hstack([powers_a, -y[:, None] * powers_b])
        row = np.sqrt(weight) * scale / bottom
        solution = np.linalg.lstsq(columns * row[:, None], y * row, rcond=None)[0]
        a, b = solution[: len(numerator)], solution[len(numerator) :]
        bottom = np.ones_like(x) if powers_b is None else 1 + powers_b @ b
        error = np.abs(powers_a @ a / bottom - y) * scale
        if best is None or error.max() < best[2]:
            best = a, b, float(error.max())
        weight *= error
        weight /= weight.sum()
    assert best is not None
    return best


def print_coefficients(name: str, values: np.ndarray, comment: str) -> None:
    print(f"// {comment}")
    numbers = ", ".join(f"{np.float32(v)}f" for v in values)
    print(f"inline constexpr float {name}[] = {{{numbers}}};\n")


def main() -> None:
    none = range(0)

    f = chebyshev_grid(np.sqrt(0.5) - 1, np.sqrt(2) - 1)
    a, _, error = fit_rational(f, -2 * np.log1p(f) / f, range(10), none, np.abs(f))
    print_coefficients("kMinus2Log1p", a, f"-2 log(1 + f) / f, f in [-0.293, 0.414], {error:.1e}")

    start = np.sqrt(2 * np.log(2))
    s = chebyshev_grid(0, np.sqrt(66 * np.log(2)) - start)
    quantile = -ndtri_exp(-((s + start) ** 2) / 2)
    a, b, error = fit_rational(s, quantile, range(1, 5), range(1, 4), np.ones_like(s))
    print_coefficients("kQuantileTop", a, f"upper normal quantile / s, top; absolute {error:.1e}")
    print_coefficients("kQuantileBottom", b, "its bottom, after the leading 1")
    print(f"inline constexpr float kQuantileStart = {np.float32(start)}f;\n")

    r = chebyshev_grid(-np.log(2) / 2 * 1.01, np.log(2) / 2 * 1.01)
    a, _, error = fit_rational(r, (np.exp(r) - 1 - r) / r**2, range(5), none, r**2)
    print_coefficients(
        "kExp", a, f"(exp(r) - 1 - r) / r^2, |r| <= log(2) / 2, absolute {error:.1e}"
    )

    x = chebyshev_grid(1e-3, 0.625)
    a, _, error = fit_rational(x**2, (np.tanh(x) / x - 1) / x**2, range(5), none, x**3 / np.tanh(x))
    print_coefficients("kTanh", a, f"(tanh(x) / x - 1) / x^2 in x^2, |x| <= 0.625, {error:.1e}")

    x = chebyshev_grid(1e-3, 0.9995)
    quarter = (np.sin(np.pi * x / 2) / x - 1) / (1 - x**2)
    a, _, error = fit_rational(x**2, quarter, range(4), none, x * (1 - x**2))
    name = "(sin(pi x / 2) / x - 1) / (1 - x^2) in x^2, |x| <= 1"
    print_coefficients("kQuarterSine", a, f"{name}, {error:.1e}")

    print("// ---- angles\n")
    r = chebyshev_grid(1e-4, np.tan(np.pi / 8) * 1.0001)
    turn = 2 * np.pi
    a, _, error = fit_rational(r**2, np.arctan(r) / (turn * r), range(5), none, turn * r)
    name = "atan(r) / (2 pi r) in r^2, |r| <= tan(pi / 8), absolute"
    print_coefficients("kArcTangent", a, f"{name} {error:.1e} radians")

    r = chebyshev_grid(1e-4, 0.125 * 1.000001)
    a, _, error = fit_rational(r**2, np.sin(turn * r) / r, range(4), none, r)
    print_coefficients("kSine", a, f"sin(2 pi r) / r in r^2, |r| <= 1/8, absolute {error:.1e}")
    a, _, error = fit_rational(r**2, np.cos(turn * r), range(5), none, np.ones_like(r))
    print_coefficients("kCosine", a, f"cos(2 pi r) in r^2, |r| <= 1/8, absolute {error:.1e}")


if __name__ == "__main__":
    main()
