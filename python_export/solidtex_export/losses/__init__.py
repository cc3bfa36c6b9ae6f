"""What judges a slice of the solid beside the exemplar."""
