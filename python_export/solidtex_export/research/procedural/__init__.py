"""Families of procedural textures; every image is a pure function of (seed, index)."""
