"""Point-E (Nichol et al. 2022), written again in torch from its published architecture, and the
noise tables that it shares with Stable Diffusion.

The original is no package; what is here follows its description, layer by layer, in plain functions
of a dictionary of weights.
"""

from itertools import pairwise

import numpy as np
import torch
from torch.nn import functional

from experiments.parity.arrays import pseudo_random, weights

CHANNELS = 6
SCALES = torch.tensor([2.0] * 3 + [0.007843137255] * 3, dtype=torch.float64)
BIASES = torch.tensor([0.0] * 3 + [-1.0] * 3, dtype=torch.float64)
WIDTH, LAYERS, HEADS, TEXT, GRID = 16, 2, 2, 8, (3, 6)  # of the tests' networks


def trunk_shapes(width: int, layers: int) -> dict[str, tuple]:
    """Arrays that both networks have, as in a checkpoint."""

    def linear(name: str, inputs: int, outputs: int) -> dict[str, tuple]:
        return {f"{name}.weight": (outputs, inputs), f"{name}.bias": (outputs,)}

    def norm(name: str) -> dict[str, tuple]:
        return {f"{name}.weight": (width,), f"{name}.bias": (width,)}

    def perceptron(name: str) -> dict[str, tuple]:
        wide = 4 * width
        return linear(f"{name}.c_fc", width, wide) | linear(f"{name}.c_proj", wide, width)

    shapes = perceptron("time_embed") | norm("ln_pre") | norm("ln_post")
    shapes |= linear("input_proj", CHANNELS, width) | linear("output_proj", width, 2 * CHANNELS)
    for layer in range(layers):
        block = f"backbone.resblocks.{layer}"
        shapes |= norm(f"{block}.ln_1") | norm(f"{block}.ln_2") | perceptron(f"{block}.mlp")
        shapes |= linear(f"{block}.attn.c_qkv", width, 3 * width)
        shapes |= linear(f"{block}.attn.c_proj", width, width)
    return shapes


def base_shapes(width: int = 512, layers: int = 12, text: int = 768) -> dict[str, tuple]:
    told = {"clip_embed.weight": (width, text), "clip_embed.bias": (width,)}
    return trunk_shapes(width, layers) | told


def upsampler_shapes(width: int = 512, layers: int = 12, grid: int = 1024) -> dict[str, tuple]:
    told = {
        "clip_embed.0.weight": (grid,),
        "clip_embed.0.bias": (grid,),
        "clip_embed.1.weight": (width, grid),
        "clip_embed.1.bias": (width,),
        "cond_point_proj.weight": (width, CHANNELS),
        "cond_point_proj.bias": (width,),
        "channel_scales": (CHANNELS,),
        "channel_biases": (CHANNELS,),
    }
    return trunk_shapes(width, layers) | told


class Network:
    """Weights by name, and the layers that read them."""

    def __init__(self, arrays: dict[str, np.ndarray], dtype: torch.dtype):
        self.arrays = {name: torch.tensor(array, dtype=dtype) for name, array in arrays.items()}

    def linear(self, name: str, x: torch.Tensor) -> torch.Tensor:
        return functional.linear(x, self.arrays[f"{name}.weight"], self.arrays[f"{name}.bias"])

    def norm(self, name: str, x: torch.Tensor) -> torch.Tensor:
        weight, bias = self.arrays[f"{name}.weight"], self.arrays[f"{name}.bias"]
        return functional.layer_norm(x, x.shape[-1:], weight, bias, 1e-5)

    def perceptron(self, name: str, x: torch.Tensor) -> torch.Tensor:
        return self.linear(f"{name}.c_proj", functional.gelu(self.linear(f"{name}.c_fc", x)))

    def attention(self, name: str, x: torch.Tensor) -> torch.Tensor:
        mixed = []
        for one in self.linear(f"{name}.c_qkv", x).chunk(HEADS, dim=-1):
            query, key, value = one.chunk(3, dim=-1)
            root = query.shape[-1] ** -0.25
            logits = (query * root) @ (key * root).transpose(1, 2)
            mixed.append(torch.softmax(logits, dim=-1) @ value)
        return self.linear(f"{name}.c_proj", torch.cat(mixed, dim=-1))

    def step(self, step: torch.Tensor) -> torch.Tensor:
        half = self.arrays["ln_pre.bias"].shape[0] // 2
        rates = torch.exp(-np.log(1e4) * torch.arange(half, dtype=step.dtype) / half)
        phase = step[:, None] * rates
        return self.perceptron("time_embed", torch.cat([phase.cos(), phase.sin()], -1))[:, None]

    def transform(self, told: list[torch.Tensor], noisy: torch.Tensor) -> torch.Tensor:
        x = self.norm("ln_pre", torch.cat([*told, self.linear("input_proj", noisy)], dim=1))
        for layer in range(LAYERS):
            block = f"backbone.resblocks.{layer}"
            x = x + self.attention(f"{block}.attn", self.norm(f"{block}.ln_1", x))
            x = x + self.perceptron(f"{block}.mlp", self.norm(f"{block}.ln_2", x))
        x = self.norm("ln_post", x)[:, sum(tokens.shape[1] for tokens in told) :]
        return self.linear("output_proj", x)

    def base(self, noisy, step, text) -> torch.Tensor:
        told = self.linear("clip_embed", text * text.shape[-1] ** 0.5)
        return self.transform([told[:, None], self.step(step)], noisy)

    def upsampler(self, noisy, step, low, grid) -> torch.Tensor:
        grid = self.linear("clip_embed.1", self.norm("clip_embed.0", grid))
        low = low * self.arrays["channel_scales"] + self.arrays["channel_biases"]
        low = self.linear("cond_point_proj", low)
        return self.transform([self.step(step), grid, low], noisy)


def inputs(name: str, *shape: int, scale: float = 1.0, dtype=torch.float32) -> torch.Tensor:
    return torch.tensor(pseudo_random(name, shape, scale), dtype=dtype)


def base() -> dict[str, np.ndarray]:
    """A text, another text, and none, at the first, a middle and the last step."""
    network = Network(weights(base_shapes(WIDTH, LAYERS, TEXT)), torch.float32)
    text = functional.normalize(inputs("text", 3, TEXT), dim=-1)
    text[2] = 0.0
    out = network.base(inputs("noisy", 3, 10, CHANNELS), torch.tensor([0.0, 500.0, 1023.0]), text)
    return {"prediction": out.numpy()}


def upsampler() -> dict[str, np.ndarray]:
    """With a picture and without. The coarse cloud has colours from 0 to 255."""
    network = Network(weights(upsampler_shapes(WIDTH, LAYERS, GRID[1])), torch.float32)
    network.arrays |= {"channel_scales": SCALES.float(), "channel_biases": BIASES.float()}
    noisy, step = inputs("noisy", 2, 7, CHANNELS), torch.tensor([3.0, 900.0])
    low = ((inputs("low", 2, 5, CHANNELS) - BIASES) / SCALES).float()
    grid = inputs("grid", 2, *GRID)
    return {
        "told": network.upsampler(noisy, step, low, grid).numpy(),
        "untold": network.upsampler(noisy, step, low, torch.zeros_like(grid)).numpy(),
    }


def sigmas_of(steps: int, smallest: float, largest: float) -> np.ndarray:
    """Karras et al. 2022, eq. 5 with rho = 7, and the 0 behind them."""
    inverse = np.linspace(largest ** (1 / 7), smallest ** (1 / 7), steps)
    return np.append(inverse**7, 0.0)


def heun(denoise, x, sigmas):
    """Karras et al. 2022, algorithm 2 without churning."""
    for sigma, later in pairwise(sigmas):
        slope = (x - denoise(x, sigma)) / sigma
        following = x + (later - sigma) * slope
        if later > 0:
            slope = 0.5 * (slope + (following - denoise(following, later)) / later)
            following = x + (later - sigma) * slope
        x = following
    return x


def karras() -> dict[str, np.ndarray]:
    """The exact denoiser of numbers about +0.5 or -0.5, each as often, with deviation 0.2."""
    sigmas = sigmas_of(12, 1e-2, 80.0)

    def denoise(x, sigma):
        variance = 0.2**2 + sigma**2
        return (0.2**2 * x + sigma**2 * 0.5 * np.tanh(0.5 * x / variance)) / variance

    noise = pseudo_random("noise", (4, 3), 2.0).astype(np.float64)
    return {"sigmas": sigmas, "clean": heun(denoise, sigmas[0] * noise, sigmas)}


def discrete(kept: np.ndarray, predict):
    """A denoiser at any sigma from a network that predicts noise at the steps of a table."""
    position = np.arange(len(kept))

    def denoise(x, sigma):
        step = int(np.interp(1 / (1 + sigma**2), kept[::-1], position[::-1]))
        steps = torch.full((x.shape[0],), float(step), dtype=x.dtype)
        noisy = x / (1 + sigma**2) ** 0.5
        clean = noisy / kept[step] ** 0.5 - (1 / kept[step] - 1) ** 0.5 * predict(noisy, steps)
        return clean.clamp(-1, 1)

    return denoise


def sampling() -> dict[str, np.ndarray]:
    """Eight coarse points guided to a text, and seven more, as clouds before any clipping.

    In float64, so that a step that a sigma belongs to cannot depend on rounding. Starting from the
    published sigmas, what a random network makes is clipped at nearly every place; little noise
    leaves numbers to compare.
    """
    double = torch.float64
    network = Network(weights(base_shapes(WIDTH, LAYERS, TEXT)), double)
    text = functional.normalize(inputs("text", 1, TEXT, dtype=double), dim=-1)
    texts = torch.cat([text, torch.zeros_like(text)])
    angle = (np.arange(1025) / 1024 + 0.008) / 1.008 * np.pi / 2
    betas = np.minimum(1 - np.cos(angle[1:]) ** 2 / np.cos(angle[:-1]) ** 2, 0.999)
    denoise = discrete(
        np.cumprod(1 - betas), lambda noisy, step: network.base(noisy, step, texts)[..., :CHANNELS]
    )

    def guided(x, sigma):
        told, untold = denoise(torch.cat([x, x]), sigma).chunk(2)
        return untold + 3 * (told - untold)

    def clouds(denoise, name, count, largest):
        sigmas = sigmas_of(10, 1e-3, largest)
        noise = inputs(name, 1, count, CHANNELS, scale=1.7, dtype=double)
        return (heun(denoise, sigmas[0] * noise, sigmas) - BIASES) / SCALES

    coarse = clouds(guided, "coarse noise", 8, 0.4)

    finer = Network(weights(upsampler_shapes(WIDTH, LAYERS, GRID[1])), double)
    finer.arrays |= {"channel_scales": SCALES, "channel_biases": BIASES}
    grid = torch.zeros(1, *GRID, dtype=double)
    betas = 1000 / 1024 * np.linspace(1e-4, 0.02, 1024)
    add = discrete(
        np.cumprod(1 - betas),
        lambda noisy, step: finer.upsampler(noisy, step, coarse, grid)[..., :CHANNELS],
    )
    return {
        "coarse": coarse.numpy(),
        "coarse_published": clouds(guided, "coarse noise", 8, 120.0).numpy(),
        "fine": clouds(add, "fine noise", 7, 0.4).numpy(),
        "fine_published": clouds(add, "fine noise", 7, 160.0).numpy(),
    }


def schedules() -> dict[str, np.ndarray]:
    """alpha^2 by step as diffusers computes it, in float32."""
    from diffusers import DDIMScheduler, DDPMScheduler

    scale = 1000 / 1024
    betas = {"beta_schedule": "scaled_linear", "beta_start": 0.00085, "beta_end": 0.012}
    tables = {
        "stable_diffusion": DDIMScheduler(**betas),
        "stable_diffusion_ddpm": DDPMScheduler(**betas),
        "point_e_base": DDPMScheduler(1024, beta_schedule="squaredcos_cap_v2"),
        "point_e_upsampler": DDPMScheduler(
            1024, beta_schedule="linear", beta_start=scale * 1e-4, beta_end=scale * 0.02
        ),
    }
    return {name: table.alphas_cumprod.numpy() for name, table in tables.items()}


GOLDEN = {
    "schedules": schedules,
    "point_e_base": base,
    "point_e_upsampler": upsampler,
    "point_e_sampling": sampling,
    "karras": karras,
}
MANIFESTS = {"point_e_base": base_shapes, "point_e_upsampler": upsampler_shapes}
