"""Priors that were published by others: Stable Diffusion and Point-E, and their guides."""
