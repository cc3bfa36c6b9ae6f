"""Generators of solids as torch modules."""
