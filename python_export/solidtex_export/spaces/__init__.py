"""Texture spaces: one network for many materials, conditioned on a code of the photograph."""
