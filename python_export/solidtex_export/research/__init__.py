"""Fidelity tables, analytic solids and pretraining of the descriptor."""
