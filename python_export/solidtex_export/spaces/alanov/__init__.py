"""Multi-texture synthesis of Alanov et al. 2019: one generator, its codes from an encoder."""
