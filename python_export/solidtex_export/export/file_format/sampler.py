"""The point family's part of a model file: sizes, and the tensors that they need."""

from solidtex_export.export.file_format.checks import Fields, Shape

MAX_OCTAVES = 256
MAX_HIDDEN_LAYERS = 64
MAX_WIDTH = 4096


def sampler_tensors(sampler: Fields, channel_count: int) -> dict[str, Shape]:
    """Checks the sizes; returns the tensors that must be in the file."""
    sampler.allow_only(("octaves", "hidden_layers", "width", "slope"))
    layers = sampler.integer("hidden_layers", 2, MAX_HIDDEN_LAYERS)
    octaves = sampler.integer("octaves", 1, MAX_OCTAVES)
    width = sampler.integer("width", 1, MAX_WIDTH)
    sampler.number("slope", 0, 1)
    if octaves % (layers - 1) != 0:
        raise sampler.wrong("octaves", f"a multiple of {layers - 1}, hidden_layers - 1")
    shapes: dict[str, Shape] = {
        "transforms": (octaves, 3, 3),
        "constant": (width,),
        "output.weight": (channel_count, width),
        "output.bias": (channel_count,),
    }
    for layer in range(layers):
        shapes[f"hidden.{layer}.weight"] = (width, width)
        shapes[f"hidden.{layer}.bias"] = (width,)
        if layer < layers - 1:
            shapes[f"hidden.{layer}.noise"] = (width, octaves // (layers - 1))
    return shapes
