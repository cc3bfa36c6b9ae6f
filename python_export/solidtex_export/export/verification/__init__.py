"""Independent evaluations of a model that what is written is compared with."""
