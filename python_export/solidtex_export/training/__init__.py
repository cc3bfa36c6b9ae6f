"""Training of generators on photographs."""
