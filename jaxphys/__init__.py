"""Text, meshes or splats to 3D Gaussians that move as their material would, in pure JAX."""
