"""The `.solidtex` file: reading, checking, writing."""
