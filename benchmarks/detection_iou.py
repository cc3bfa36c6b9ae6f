"""IoU of solidtex-detect on a photograph that is composed of several materials.

benchmarks/detection_iou.py stones A.jpg B.jpg C.jpg D.jpg -o FOLDER

Four photographs, reduced to the space's resolution, are the quarters of one. In each quarter the
patch in the middle is looked for. Printed is the IoU at 0.5 and at the best threshold of the map.
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image

PROGRAM = Path(__file__).resolve().parent.parent / "build" / "bin" / "solidtex-detect"
QUARTER, PATCH = 256, 128


def quarter(path: Path) -> np.ndarray:
    image = Image.open(path).convert("RGB")
    scale = QUARTER / min(image.size)
    size = [max(QUARTER, round(scale * side)) for side in image.size]
    return np.asarray(image.resize(size, Image.Resampling.LANCZOS))[:QUARTER, :QUARTER]


def iou(found: np.ndarray, truth: np.ndarray) -> float:
    return float((found & truth).sum() / (found | truth).sum())


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("space")
    p.add_argument("photos", nargs=4, type=Path)
    p.add_argument("-o", dest="folder", type=Path, required=True)
    p.add_argument("--step", type=int, default=8)
    p.add_argument("--alpha", type=float, default=3.0)
    args = p.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    a, b, c, d = map(quarter, args.photos)
    composed = args.folder / "composed.png"
    Image.fromarray(np.vstack([np.hstack([a, b]), np.hstack([c, d])])).save(composed)
    for i, photo in enumerate(args.photos):
        top, left = QUARTER * (i // 2), QUARTER * (i % 2)
        middle = (QUARTER - PATCH) // 2
        patch = f"{left + middle},{top + middle},{PATCH},{PATCH}"
        heat = args.folder / f"heat-{i}.exr"
        options = ["--step", str(args.step), "--alpha", str(args.alpha), "--force"]
        command = [str(PROGRAM), args.space, str(composed), "--patch", patch, "-o", str(heat)]
        subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL)
        found = oiio.ImageBuf(str(heat)).get_pixels(oiio.FLOAT)[:, :, 0]
        Image.fromarray(np.rint(255 * found).astype(np.uint8)).save(heat.with_suffix(".png"))
        truth = np.zeros(found.shape, bool)
        truth[top : top + QUARTER, left : left + QUARTER] = True
        levels = np.unique(np.quantile(found, np.linspace(0, 0.999, 200)))
        scores = [iou(found >= level, truth) for level in levels]
        best = int(np.argmax(scores))
        print(
            f"{photo.stem}: IoU {iou(found >= 0.5, truth):.3f} at 0.5, best {scores[best]:.3f} at"
            f" {levels[best]:.3g}",
            flush=True,
        )


if __name__ == "__main__":
    main()
