"""Converts a `.solidtex` model to ONNX: one block (lattice family) or points (sampler family)."""

from __future__ import annotations

import json

import onnx
from onnx import ModelProto, helper

from solidtex_export import __version__
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.onnx.inputs import DOCUMENT_VERSION, METADATA_KEY
from solidtex_export.export.onnx.lattice import lattice_graph
from solidtex_export.export.onnx.sampler import sampler_graph
from solidtex_export.generators.lattice import Box

OPSET = 17
IR_VERSION = 8
"""Versions that runtimes of 2022 and later read."""

SHARED_KEYS = ("name", "family", "channels", "color_space", "noise", "license", "exemplar")


def onnx_model(model: ModelFile, box: Box | None) -> ModelProto:
    """ONNX model that computes `box`, or points for the sampler family."""
    graph, usage = lattice_graph(model, box) if box else sampler_graph(model)
    found = helper.make_model(
        graph,
        producer_name="solidtex",
        producer_version=__version__,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
    )
    shared = {key: model.document[key] for key in SHARED_KEYS if key in model.document}
    document = {"version": DOCUMENT_VERSION} | shared | usage
    helper.set_model_props(found, {METADATA_KEY: json.dumps(document)})
    onnx.checker.check_model(found, full_check=True)
    return found
