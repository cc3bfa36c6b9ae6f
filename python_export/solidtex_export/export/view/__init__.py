"""A page that evaluates models of the sampler family in the browser."""
