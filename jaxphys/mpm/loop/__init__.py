"""The loop: one pass over chunks of particles a step, over devices, forth and back."""
