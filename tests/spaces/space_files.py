"""Random spaces on disk, and a plain numpy decoder that is independent of the engine."""

from pathlib import Path
from typing import Any

import numpy as np

from solidtex_export.spaces.random_space import RandomSpace, Sizes, random_space

KINDS = {
    "lattice": Sizes(name="lattice"),
    "bounded": Sizes(name="bounded", family="sampler"),
    "linear": Sizes(name="linear", family="sampler", transforms="linear", colors="network"),
}


def write(folder: Path, kind: str, space: RandomSpace | None = None) -> Path:
    path = folder / f"{kind}.solidtex-space"
    path.write_bytes((space or random_space(KINDS[kind])).encode())
    return path


def axes(image: np.ndarray) -> np.ndarray:
    """[basis | mean] of an image by the contract's rule, with numpy's eigenvectors."""
    pixels = image.reshape(-1, 3).astype(np.float64)
    variances, vectors = np.linalg.eigh(np.cov(pixels.T))
    variances, vectors = variances[::-1], vectors[:, ::-1]
    vectors = vectors * np.where(vectors.sum(0) < 0, -1, 1)
    deviations = np.sqrt(np.maximum(variances, 1e-8))
    deviations = np.maximum(deviations, 0.15 * deviations[0])
    return np.column_stack([vectors * deviations, pixels.mean(0)])


def decode(space: RandomSpace, z: np.ndarray, colors: np.ndarray | None) -> dict[str, np.ndarray]:
    """The tensors of the model of a code, in float64."""
    tensors = {n: t.astype(np.float64) for n, t in space.tensors.items() if n != "encoder"}
    style = _two_layers(tensors, "style", z)
    affine = np.eye(3, 4) if colors is None else colors.astype(np.float64)
    if space.document["family"] == "lattice":
        return _lattice(tensors, style, affine)
    return _sampler(tensors, style, affine, _transforms(space.document, tensors, z))


def _two_layers(tensors: dict[str, np.ndarray], name: str, x: np.ndarray) -> np.ndarray:
    for layer in (0, 1):
        x = tensors[f"{name}.{layer}.weight"] @ x + tensors[f"{name}.{layer}.bias"]
        x = np.where((x > 0) | (layer == 1), x, 0.2 * x)
    return x


def _condition(
    tensors: dict[str, np.ndarray], name: str, style: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    both = tensors[f"condition.{name}.weight"] @ style + tensors[f"condition.{name}.bias"]
    gamma, delta = np.split(both, 2)
    return 1 + gamma, delta


def _colored(weight: np.ndarray, bias: np.ndarray, affine: np.ndarray) -> Any:
    basis, mean = affine[:, :3], affine[:, 3]
    return np.einsum("rk,k...->r...", basis, weight), basis @ bias + mean


def _lattice(
    tensors: dict[str, np.ndarray], style: np.ndarray, affine: np.ndarray
) -> dict[str, np.ndarray]:
    found = {}
    for name in (n.removesuffix(".weight") for n, t in tensors.items() if t.ndim == 5):
        weight, bias = tensors[f"{name}.weight"], tensors[f"{name}.bias"]
        if name == "last_conv":
            weight, bias = _colored(weight, bias, affine)
        else:
            gamma, delta = _condition(tensors, name, style)
            weight, bias = weight * gamma[:, None, None, None, None], bias * gamma + delta
        found |= {f"{name}.weight": weight, f"{name}.bias": bias}
    return found


def _transforms(
    document: dict[str, Any], tensors: dict[str, np.ndarray], z: np.ndarray
) -> np.ndarray:
    scales = tensors["scales"][:, None, None]
    q = _two_layers(tensors, "transforms", z).reshape(len(scales), -1)
    if document["sampler"]["transforms"] == "linear":
        return scales * q.reshape(-1, 3, 3)
    s = q / (1 + np.abs(q))
    matrix = np.eye(3) + s[:, :9].reshape(-1, 3, 3) / 2
    t, e = s[:, 9, None, None] / 2, 0.9 * s[:, 10]
    found = scales * (1 + t) / (1 - t) * (matrix @ tensors["base"])
    found[:, :, 2] *= ((1 + e) / (1 - e))[:, None]
    return found


def _sampler(
    tensors: dict[str, np.ndarray], style: np.ndarray, affine: np.ndarray, transforms: np.ndarray
) -> dict[str, np.ndarray]:
    found = {"transforms": transforms, "constant": tensors["constant"]}
    found |= {n: t for n, t in tensors.items() if n.startswith("hidden") and n.endswith("noise")}
    layers = sorted(
        n.removesuffix(".weight") for n in tensors if n.startswith("hidden") and "weight" in n
    )
    gamma, delta = np.ones(len(tensors["constant"])), np.zeros(len(tensors["constant"]))
    for name in [*layers, "output"]:
        weight, bias = tensors[f"{name}.weight"], tensors[f"{name}.bias"]
        weight, bias = weight * gamma, bias + weight @ delta
        if name == "output":
            weight, bias = _colored(weight, bias, affine)
        else:
            gamma, delta = _condition(tensors, name, style)
        found |= {f"{name}.weight": weight, f"{name}.bias": bias}
    return found
