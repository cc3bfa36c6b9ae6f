"""Training of solid textures and their export to `.solidtex` files."""

__version__ = "0.1.0"
