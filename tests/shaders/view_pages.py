"""What tests of the page of solidtex-view share."""

import base64
import io
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

REPOSITORY = Path(__file__).resolve().parents[2]
MODELS = REPOSITORY / "models"
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
           "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]  # fmt: skip
SIZE = WIDTH, HEIGHT = 64, 48
EYE, FIELD_OF_VIEW = np.array([2.5, 2.0, 3.0]), 0.7
TEXELS = 24  # across: 0.4 a pixel
CAMERA = {"eye": EYE.tolist(), "target": [0, 0, 0], "fieldOfView": FIELD_OF_VIEW}
# A byte, and the halves of the weights.
BOUND = 1 / 255 + 2e-3
FLAT = {"camera": CAMERA, "lit": False, "filter": False, "texels": TEXELS}


def hits(side: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Points where the rays of the pixels enter the cube whose x ends at `side`, and which do."""
    back = EYE / np.linalg.norm(EYE)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    half = np.tan(FIELD_OF_VIEW / 2)
    x = ((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1) * half * WIDTH / HEIGHT
    y = (1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2) * half
    rays = x[None, :, None] * right + y[:, None, None] * up - back
    low, high = np.array([-1.0, -1, -1]), np.array([side, 1, 1])
    planes = np.stack([(low - EYE) / rays, (high - EYE) / rays])
    enter, leave = planes.min(axis=0).max(axis=-1), planes.max(axis=0).min(axis=-1)
    # Rays that only graze an edge are left out.
    return EYE + enter[..., None] * rays, leave - enter > 0.03


def opened(
    browser: Any, file: Path, query: str = "", size: tuple[int, int] = SIZE, script: str = ""
) -> Any:
    """The page once it has drawn or said why not; `script` runs before those of the page."""
    page = browser.new_page(viewport=dict(zip(("width", "height"), size, strict=True)))
    page.set_default_timeout(300_000)
    page.add_init_script(script)
    page.goto(f"file://{file}{query}")
    page.evaluate("solidtex.ready")
    return page


def message(page: Any) -> str:
    return str(page.evaluate("document.getElementById('message').textContent"))


def picture(page: Any, **changes: object) -> np.ndarray:
    """Pixels of the canvas, 0 to 1, rows from the top."""
    page.evaluate("changes => solidtex.set(changes)", changes)
    assert message(page) == ""
    return pixels_of(page.evaluate("document.getElementById('canvas').toDataURL()"))


def pixels_of(url: str) -> np.ndarray:
    """Pixels of a data URL, 0 to 1, rows from the top."""
    image = Image.open(io.BytesIO(base64.b64decode(url.split(",")[1])))
    return np.asarray(image.convert("RGB")) / 255
