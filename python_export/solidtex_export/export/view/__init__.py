"""A page that evaluates models in the browser."""
