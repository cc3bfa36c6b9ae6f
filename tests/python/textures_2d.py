"""Small synthetic textures, for tests: images float32 [row, column, channel] in 0 ... 1."""

import numpy as np
import torch
from scipy.ndimage import gaussian_filter

from solidtex_export.evaluation.pictures import to_8_bit

DARK, LIGHT = np.array([0.25, 0.2, 0.15]), np.array([0.8, 0.7, 0.5])


def noise(*shape: int, seed: int = 0) -> torch.Tensor:
    """White noise of any shape, as a tensor of mean zero and variance one."""
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed))


def blobs(
    seed: int, rows: int = 160, columns: int = 256, sigma: tuple[float, float] = (4.0, 4.0)
) -> np.ndarray:
    """Two colors with sharp outlines, and a little grain."""
    rng = np.random.default_rng(seed)
    field = gaussian_filter(rng.standard_normal((rows + 64, columns + 64)), sigma)[32:-32, 32:-32]
    inside = np.clip(field / field.std() * 4 + 0.5, 0, 1)[..., None]
    return to_8_bit(DARK + inside * (LIGHT - DARK) + rng.normal(0, 0.02, (rows, columns, 1)))


def shuffled(picture: np.ndarray) -> np.ndarray:
    """White noise with the colors of an image."""
    flat = picture.reshape(-1, picture.shape[2])
    return np.random.default_rng(0).permutation(flat).reshape(picture.shape)


def blurred(picture: np.ndarray, sigma: float = 1.5) -> np.ndarray:
    return to_8_bit(gaussian_filter(picture, (sigma, sigma, 0)))


def random_phase(picture: np.ndarray) -> np.ndarray:
    """Gaussian noise with the spectrum and the cross-spectra of an image (Galerne et al. 2011)."""
    noise = np.random.default_rng(0).standard_normal(picture.shape[:2])
    phase = np.exp(1j * np.angle(np.fft.fft2(noise)))[..., None]
    spectrum = np.fft.fft2(picture, axes=(0, 1))
    phase[0, 0] = 1
    return to_8_bit(np.real(np.fft.ifft2(spectrum * phase, axes=(0, 1))))


def tiled(picture: np.ndarray, side: int = 48) -> np.ndarray:
    """A piece of an image, four times in each direction."""
    return np.tile(picture[:side, :side], (4, 4, 1))
