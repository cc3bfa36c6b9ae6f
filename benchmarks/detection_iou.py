"""IoU of solidtex-detect on a photograph that is composed of several materials.

benchmarks/composed_photograph.py A.jpg B.jpg C.jpg D.jpg -o composed.png
benchmarks/detection_iou.py stones composed.png --columns 2 -o FOLDER

In each cell the patch in the middle is looked for. Printed is the IoU of the map with the cell, at
0.5 and at the best threshold of the map.
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image

PROGRAM = Path(__file__).resolve().parent.parent / "build" / "bin" / "solidtex-detect"


def iou(found: np.ndarray, truth: np.ndarray) -> float:
    return float((found & truth).sum() / (found | truth).sum())


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("space")
    p.add_argument("photo", type=Path, help="a picture of composed_photograph.py")
    p.add_argument("-o", dest="folder", type=Path, required=True)
    p.add_argument("--columns", type=int, default=2, help="cells side by side (default: 2)")
    p.add_argument("--patch", type=int, default=128, help="side of a patch (default: 128)")
    p.add_argument("--step", type=int, default=8)
    p.add_argument("--alpha", type=float, default=3.0)
    args = p.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    cell = Image.open(args.photo).size[0] // args.columns
    middle = (cell - args.patch) // 2
    for i in range(args.columns**2):
        top, left = (cell * place for place in divmod(i, args.columns))
        patch = f"{left + middle},{top + middle},{args.patch},{args.patch}"
        heat = args.folder / f"heat-{i}.exr"
        options = ["--step", str(args.step), "--alpha", str(args.alpha), "--force"]
        command = [str(PROGRAM), args.space, str(args.photo), "--patch", patch, "-o", str(heat)]
        subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL)
        found = oiio.ImageBuf(str(heat)).get_pixels(oiio.FLOAT)[:, :, 0]
        Image.fromarray(np.rint(255 * found).astype(np.uint8)).save(heat.with_suffix(".png"))
        truth = np.zeros(found.shape, bool)
        truth[top : top + cell, left : left + cell] = True
        levels = np.unique(np.quantile(found, np.linspace(0, 0.999, 200)))
        scores = [iou(found >= level, truth) for level in levels]
        best = int(np.argmax(scores))
        print(
            f"cell {i}: IoU {iou(found >= 0.5, truth):.3f} at 0.5, best {scores[best]:.3f} at"
            f" {levels[best]:.3g}",
            flush=True,
        )


if __name__ == "__main__":
    main()
