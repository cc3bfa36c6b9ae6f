"""Renders the thumbnails of the shipped models that have none:

python plugins/blender/make_thumbnails.py build/bin/solidtex-bake
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

BLENDER = Path(__file__).resolve().parent
MODELS = BLENDER.parent.parent / "models"
EDGE = 128  # as THUMBNAIL_EDGE of extension/operators.py


def make_thumbnail(bake: str, model: Path, thumbnail: Path) -> None:
    """Keep the cube of a preview of solidtex-bake, which is the square on its left, small."""
    with tempfile.TemporaryDirectory() as folder:
        preview = Path(folder) / "preview.png"
        subprocess.run([bake, model, "--preview", preview], check=True)
        with Image.open(preview) as picture:
            cube = picture.convert("RGB").crop((0, 0, picture.height, picture.height))
    cube.resize((EDGE, EDGE), Image.Resampling.LANCZOS).save(thumbnail, quality=90)


for model in sorted(MODELS.glob("*.solidtex")):
    thumbnail = BLENDER / "extension" / "thumbnails" / f"{model.stem}.jpg"
    if not thumbnail.exists():
        make_thumbnail(sys.argv[1], model, thumbnail)
        print(thumbnail)
