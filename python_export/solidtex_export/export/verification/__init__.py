"""Independent evaluations of a model, for the verification of exported files."""
