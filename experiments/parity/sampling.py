"""Trajectories of diffusers' DDIM and DDPM schedulers for a simple denoiser."""

import numpy as np

from experiments.parity.arrays import pseudo_random

CONFIG = {
    "num_train_timesteps": 1000,
    "beta_start": 0.00085,
    "beta_end": 0.012,
    "beta_schedule": "scaled_linear",
    "clip_sample": False,
    "steps_offset": 1,
    "timestep_spacing": "leading",
}
STEPS = 20
SHAPE = (2, 3, 3, 4)
FRESH = 0.7  # every number of the noise that DDPM draws


def prediction(noisy, time):
    """Stands in for a network: of numpy, jax or torch arrays, time in [0, 1]."""
    return noisy * (0.9 - 0.5 * time) + 0.1 * noisy**2 / (1.0 + noisy**2)


def _trajectory(kind: str, predicts: str) -> np.ndarray:
    import torch
    from diffusers import DDIMScheduler, DDPMScheduler
    from diffusers.schedulers import scheduling_ddpm

    if kind == "ddim":
        scheduler = DDIMScheduler(**CONFIG, prediction_type=predicts, set_alpha_to_one=False)
    else:
        scheduler = DDPMScheduler(**CONFIG, prediction_type=predicts)
        scheduling_ddpm.randn_tensor = lambda shape, **_: torch.full(shape, FRESH)
    scheduler.set_timesteps(STEPS)
    noisy = torch.from_numpy(pseudo_random("sampling", SHAPE, 1.7))
    seen = []
    for step in scheduler.timesteps:
        noisy = scheduler.step(prediction(noisy, float(step) / 999), step, noisy).prev_sample
        seen.append(noisy.numpy())
    return np.stack(seen)


def trajectories() -> dict[str, np.ndarray]:
    """(STEPS, *SHAPE) samples by sampler and by what is predicted."""
    names = [(kind, what) for kind in ("ddim", "ddpm") for what in ("epsilon", "v_prediction")]
    return {f"{kind}_{what}": _trajectory(kind, what) for kind, what in names}


GOLDEN = {"sampling": trajectories}
MANIFESTS: dict = {}
