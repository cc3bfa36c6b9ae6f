"""Losses that compare slices of a solid with the exemplar."""
