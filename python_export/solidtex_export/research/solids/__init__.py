"""Analytic solids: endless materials that are formulas, whose true 3D statistics are known."""
