"""One module per command line."""
