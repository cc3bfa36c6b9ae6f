"""Photographs in: files, channels, color spaces."""
