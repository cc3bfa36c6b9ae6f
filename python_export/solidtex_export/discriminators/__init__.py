"""Discriminators and how they are trained."""
