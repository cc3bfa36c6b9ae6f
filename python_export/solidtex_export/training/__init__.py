"""One photograph in, a trained generator out."""
