"""Models on the GPU: samplers as functions in shading languages, lattices as compute passes."""
