"""Prints the figures of docs/shader-export.md: sizes, and differences from the engine.

    python benchmarks/measure_shaders.py models/stone-grey.solidtex models/wood-oak.solidtex

The shaders run on Mesa's software GPU: WGSL in Vulkan, GLSL in OpenGL.
"""

import argparse
from itertools import product
from pathlib import Path

import numpy as np
from shader_gpu import Points, run_shader

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import PRECISIONS
from solidtex_export.export.shader.shader import BY_SUFFIX, shader

POINTS = 2048


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", type=Path, nargs="+")
    models = {path.stem: model_file.read(path) for path in parser.parse_args().models}
    print_sizes(models)
    print_errors(models)


def print_sizes(models: dict[str, ModelFile]) -> None:
    print("| model | language | weights | precision | source, bytes | data, bytes |")
    print("|---|---|---|---|--:|--:|")
    for (name, model), (suffix, emitter) in product(models.items(), BY_SUFFIX.items()):
        for storage, precision in product(emitter.storages, emitter.precisions):
            made = shader(model, suffix, "solidtex_" + name.replace("-", "_"), storage, precision)
            data = "none" if made.data is None else made.data.nbytes
            row = (name, emitter.language, storage, precision, len(made.text), data)
            print("|", " | ".join(map(str, row)), "|")
    print()


def print_errors(models: dict[str, ModelFile]) -> None:
    print("| model | language | weights | precision | points | far points | footprints | 99.9 % |")
    print("|---|---|---|---|--:|--:|--:|--:|")
    for name, model in models.items():
        points = Points(model, POINTS)
        middle = POINTS // 2
        groups = [slice(1, middle, 2), slice(0, middle, 2), slice(middle, POINTS)]
        for suffix, precision in product((".wgsl", ".glsl"), PRECISIONS):
            for storage in ("buffer", "texture"):
                errors = points.errors(run_shader(model, points, suffix, storage, precision))
                found = [*(errors[group].max() for group in groups), np.quantile(errors, 0.999)]
                row = (name, BY_SUFFIX[suffix].language, storage, precision)
                print("|", " | ".join([*row, *(f"{error:.1e}" for error in found)]), "|")


if __name__ == "__main__":
    main()
