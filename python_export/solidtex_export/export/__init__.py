"""Conversion of training results to model files and ONNX."""
