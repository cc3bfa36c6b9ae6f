"""Measures volumes as material scientists do: geometry, transport and representative volumes."""
