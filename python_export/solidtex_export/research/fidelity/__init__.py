"""Comparison of presets on exemplars: docs/fidelity.md."""
