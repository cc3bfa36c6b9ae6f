"""Models of the sampler family as functions in shading languages."""
