"""Readers of photographs: files, channels, color spaces."""
