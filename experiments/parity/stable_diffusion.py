"""Stable Diffusion's denoiser and autoencoder as diffusers computes them."""

import numpy as np
import torch
from diffusers import AutoencoderKL, UNet2DConditionModel

from experiments.parity.arrays import pseudo_random, weights

# As published with Stable Diffusion 1.5 and 2.1-base; what is left out has its default.
UNET_15 = {"sample_size": 64, "cross_attention_dim": 768, "attention_head_dim": 8}
UNET_21 = {
    "sample_size": 64,
    "cross_attention_dim": 1024,
    "attention_head_dim": [5, 10, 20, 20],
    "use_linear_projection": True,
}
VAE = {
    "block_out_channels": [128, 256, 512, 512],
    "down_block_types": ["DownEncoderBlock2D"] * 4,
    "up_block_types": ["UpDecoderBlock2D"] * 4,
    "layers_per_block": 2,
    "sample_size": 512,
}
OLD_NAMES = {"to_q": "query", "to_k": "key", "to_v": "value", "to_out.0": "proj_attn"}

# The tests' networks: small, but with every kind of block.
TINY_15 = {
    "sample_size": 8,
    "block_out_channels": [8, 16],
    "layers_per_block": 2,
    "down_block_types": ["CrossAttnDownBlock2D", "DownBlock2D"],
    "up_block_types": ["UpBlock2D", "CrossAttnUpBlock2D"],
    "cross_attention_dim": 12,
    "attention_head_dim": 2,
    "norm_num_groups": 4,
}
TINY_21 = TINY_15 | {
    "block_out_channels": [8, 12, 16],
    "layers_per_block": 1,
    "down_block_types": ["CrossAttnDownBlock2D", "CrossAttnDownBlock2D", "DownBlock2D"],
    "up_block_types": ["UpBlock2D", "CrossAttnUpBlock2D", "CrossAttnUpBlock2D"],
    "attention_head_dim": [1, 2, 4],
    "use_linear_projection": True,
}
TINY_VAE = {
    "block_out_channels": [8, 16],
    "down_block_types": ["DownEncoderBlock2D"] * 2,
    "up_block_types": ["UpDecoderBlock2D"] * 2,
    "layers_per_block": 1,
    "norm_num_groups": 4,
}


def shapes(model: torch.nn.Module) -> dict[str, tuple]:
    return {name: tuple(array.shape) for name, array in model.state_dict().items()}


def filled(model: torch.nn.Module) -> torch.nn.Module:
    arrays = weights(shapes(model))
    model.load_state_dict({name: torch.from_numpy(array) for name, array in arrays.items()})
    return model.eval().requires_grad_(False)


def channels_first(array: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(array.transpose(0, 3, 1, 2).copy())


def channels_last(tensor: torch.Tensor) -> np.ndarray:
    return tensor.detach().numpy().transpose(0, 2, 3, 1)


def unet(config: dict, height: int, width: int) -> dict[str, np.ndarray]:
    """What it says of two latents at steps 0.5 and 981, told different texts."""
    latents = channels_first(pseudo_random("latents", (2, height, width, 4), 1.7))
    states = torch.from_numpy(pseudo_random("states", (2, 5, config["cross_attention_dim"])))
    model = filled(UNet2DConditionModel(**config))
    return {"output": channels_last(model(latents, torch.tensor([0.5, 981.0]), states).sample)}


def encoder() -> dict[str, np.ndarray]:
    """Mean, log-variance, and the gradient to the picture of their product with random numbers."""
    images = channels_first(pseudo_random("images", (2, 10, 16, 3))).requires_grad_()
    found = filled(AutoencoderKL(**TINY_VAE)).encode(images).latent_dist
    product = sum(
        (part * channels_first(pseudo_random(name, (2, 5, 8, 4)))).sum()
        for name, part in (("to mean", found.mean), ("to log-variance", found.logvar))
    )
    (gradient,) = torch.autograd.grad(product, images)
    arrays = {"mean": found.mean, "log_variance": found.logvar, "gradient": gradient}
    return {name: channels_last(tensor) for name, tensor in arrays.items()}


def decoder() -> dict[str, np.ndarray]:
    latents = channels_first(pseudo_random("latents", (2, 5, 8, 4), 1.7))
    return {"output": channels_last(filled(AutoencoderKL(**TINY_VAE)).decode(latents).sample)}


def manifest(kind: type, config: dict) -> dict[str, tuple]:
    with torch.device("meta"):
        return shapes(kind(**config))


def old_names(arrays: dict[str, tuple]) -> dict[str, tuple]:
    """The autoencoder's attention as the files of Stable Diffusion 1.5 and 2.1-base name it."""
    renamed = {}
    for name, shape in arrays.items():
        for new, old in OLD_NAMES.items():
            name = name.replace(f".attentions.0.{new}.", f".attentions.0.{old}.")
        renamed[name] = shape
    return renamed


GOLDEN = {
    "sd15_unet": lambda: unet(TINY_15, 8, 6),
    "sd21_unet": lambda: unet(TINY_21, 7, 10),
    "sd_encoder": encoder,
    "sd_decoder": decoder,
}
MANIFESTS = {
    "sd15_unet": lambda: manifest(UNet2DConditionModel, UNET_15),
    "sd21_unet": lambda: manifest(UNet2DConditionModel, UNET_21),
    "sd_vae": lambda: manifest(AutoencoderKL, VAE),
    "sd_vae_old_names": lambda: old_names(manifest(AutoencoderKL, VAE)),
    "sd15_unet_tiny": lambda: manifest(UNet2DConditionModel, TINY_15),
    "sd21_unet_tiny": lambda: manifest(UNet2DConditionModel, TINY_21),
    "sd_vae_tiny": lambda: manifest(AutoencoderKL, TINY_VAE),
}
