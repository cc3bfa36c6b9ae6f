"""Comparison of a solid texture with its exemplar: docs/evaluation.md."""
