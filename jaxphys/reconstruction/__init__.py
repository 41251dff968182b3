"""From photographs with known cameras to Gaussians: captures, losses, the optimisation."""
