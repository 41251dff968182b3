"""Diffusion itself: schedules, samplers and score distillation; knows no prior."""
