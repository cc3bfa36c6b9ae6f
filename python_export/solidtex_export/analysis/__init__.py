"""What is measured on a photograph, and which preset follows."""
