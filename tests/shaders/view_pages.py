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
FLAT = {"camera": CAMERA, "lit": False, "filter": False, "texels": TEXELS}


def message(page: Any) -> str:
    return str(page.evaluate("document.getElementById('message').textContent"))


def picture(page: Any, **changes: object) -> np.ndarray:
    """Pixels of the canvas, 0 to 1, rows from the top."""
    page.evaluate("changes => solidtex.set(changes)", changes)
    assert message(page) == ""
    url = page.evaluate("document.getElementById('canvas').toDataURL()")
    image = Image.open(io.BytesIO(base64.b64decode(url.split(",")[1])))
    return np.asarray(image.convert("RGB")) / 255
