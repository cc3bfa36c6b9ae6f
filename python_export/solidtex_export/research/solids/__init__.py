"""Analytic solids: infinite materials defined by formulas, with known 3D statistics."""
