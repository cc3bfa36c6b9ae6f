"""The networks that define a solid, as torch modules, and how they are folded."""
