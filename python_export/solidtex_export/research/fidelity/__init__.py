"""Exemplars x methods, trained and compared: docs/fidelity.md."""
