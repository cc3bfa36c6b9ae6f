"""From a training result to files that others open: model files and ONNX."""
