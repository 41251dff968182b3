"""Point-E (Nichol et al. 2022), and the noise tables that it shares with Stable Diffusion."""

import numpy as np


def schedules() -> dict[str, np.ndarray]:
    """alpha^2 by step as diffusers computes it, in float32."""
    from diffusers import DDIMScheduler, DDPMScheduler

    scale = 1000 / 1024
    tables = {
        "stable_diffusion": DDIMScheduler(
            beta_schedule="scaled_linear", beta_start=0.00085, beta_end=0.012
        ),
        "stable_diffusion_ddpm": DDPMScheduler(
            beta_schedule="scaled_linear", beta_start=0.00085, beta_end=0.012
        ),
        "point_e_base": DDPMScheduler(1024, beta_schedule="squaredcos_cap_v2"),
        "point_e_upsampler": DDPMScheduler(
            1024, beta_schedule="linear", beta_start=scale * 1e-4, beta_end=scale * 0.02
        ),
    }
    return {name: table.alphas_cumprod.numpy() for name, table in tables.items()}


GOLDEN = {"schedules": schedules}
MANIFESTS = {}
