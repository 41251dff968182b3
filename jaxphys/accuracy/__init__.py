"""How right a motion is, and what a wanted accuracy costs: arrays and numbers in, numbers out.

`convergence` reads an order and an error off three motions of the same points on three grids,
`pilot_particles` makes the coarse particles of a pilot, `choice` picks the spacing that a tolerance
asks for. Who runs pilots is the pipeline's business (`pipeline.tolerance`).
"""
