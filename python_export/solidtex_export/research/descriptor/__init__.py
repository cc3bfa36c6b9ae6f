"""A descriptor of textures: a small network trained on procedural images only."""
