"""Pretraining of the descriptor network on procedural images."""
