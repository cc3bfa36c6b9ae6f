"""Measurements on photographs and the choice of a preset from them."""
