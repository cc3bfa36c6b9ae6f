"""Frames per second of the page of solidtex-view: a cut cube in 1920 x 1080, in headless Chromium.

    python benchmarks/measure_view.py granite-grey stone-grey

Prints the seconds of the first picture, which computes what is visible, and the mean of pictures
that turn a little: of a lattice they need no new bricks. Chromium's software adapter draws, unless
--gpu leaves the choice to the browser.
"""

import argparse
import shutil
import tempfile
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from solidtex_export.commands import view

SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--use-webgpu-adapter=swiftshader"]  # fmt: skip
TIMED = """async ([changes, frames]) => {
  const started = performance.now();
  for (let i = 0; i < frames; ++i) {
    solidtex.state.yaw += changes.turn;
    await solidtex.set(changes);
  }
  return (performance.now() - started) / frames / 1e3;
}"""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+")
    parser.add_argument("--size", type=int, nargs=2, default=(1920, 1080))
    parser.add_argument("--texels", type=int, default=256, help="across the cube (default 256)")
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--backend", choices=("webgpu", "webgl", "webassembly"),
                        default="webgpu")  # fmt: skip
    parser.add_argument("--gpu", action="store_true", help="draw on the GPU")
    args = parser.parse_args()
    chromium = shutil.which("chromium-headless-shell") or shutil.which("chromium")
    options = ["--no-sandbox", "--enable-unsafe-webgpu", *([] if args.gpu else SOFTWARE)]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as p:
        file = Path(folder, "view.html")
        assert view.main([*args.models, "-o", str(file)]) == 0
        browser = p.chromium.launch(executable_path=chromium, args=options)
        width, height = args.size
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(3_600_000)
        controls = f"texels={args.texels}&place=16,16,16&cut=x&at=0.2"
        page.goto(f"file://{file}?backend={args.backend}&{controls}")
        page.evaluate("solidtex.ready")
        print("| model | backend | first picture, s | bricks | frame, s | frames a second |")
        print("|---|---|--:|--:|--:|--:|")
        for index, model in enumerate(args.models):
            measure(page, index, model, args.frames)


def measure(page: Any, index: int, model: str, frames: int) -> None:
    first = page.evaluate(TIMED, [{"model": index, "turn": 0, "seed": "1"}, 1])
    bricks = page.evaluate("view.material?.slots?.size ?? 'none'")
    frame = page.evaluate(TIMED, [{"turn": 1e-4}, frames])
    message = page.evaluate("document.getElementById('message').textContent")
    assert not message, message
    backend = page.evaluate("solidtex.backend()")
    cells = (Path(model).stem, backend, f"{first:.1f}", bricks, f"{frame:.3f}", f"{1 / frame:.2f}")
    print("|", " | ".join(map(str, cells)), "|", flush=True)


if __name__ == "__main__":
    main()
