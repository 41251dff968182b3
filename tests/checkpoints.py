"""Tiny random checkpoints on disk, in the layouts that the published ones come in."""

import json
import zipfile
from pathlib import Path

import numpy as np
from flax import nnx
from safetensors.numpy import save_file
from tokenizers import pre_tokenizers

from experiments.parity.arrays import weights
from jaxphys.networks import autoencoder, clip_config, clip_text, clip_vision, point_e, unet
from jaxphys.networks.parameters import named_parameters, published_name, published_shape

UNET = {
    "_class_name": "UNet2DConditionModel",
    "sample_size": 8,
    "block_out_channels": [8, 16],
    "layers_per_block": 1,
    "down_block_types": ["CrossAttnDownBlock2D", "DownBlock2D"],
    "up_block_types": ["UpBlock2D", "CrossAttnUpBlock2D"],
    "cross_attention_dim": 16,
    "attention_head_dim": 2,
    "norm_num_groups": 4,
}
VAE = {
    "_class_name": "AutoencoderKL",
    "block_out_channels": [8, 16],
    "down_block_types": ["DownEncoderBlock2D"] * 2,
    "up_block_types": ["UpDecoderBlock2D"] * 2,
    "layers_per_block": 1,
    "norm_num_groups": 4,
    "sample_size": 16,
    "scaling_factor": 0.18215,
}
SCHEDULER = {
    "_class_name": "PNDMScheduler",
    "beta_start": 0.00085,
    "beta_end": 0.012,
    "beta_schedule": "scaled_linear",
    "num_train_timesteps": 1000,
    "prediction_type": "epsilon",
}
TOWER = {
    "hidden_size": 16,
    "intermediate_size": 32,
    "num_hidden_layers": 1,
    "num_attention_heads": 2,
    "projection_dim": 24,
}
TEXT = TOWER | {"max_position_embeddings": 77, "eos_token_id": 2}
VISION = TOWER | {"image_size": 224, "patch_size": 112}

# Ours and the published names, where a module is not named as the file's keys are.
VAE_NAMES = ((".to_out.", ".to_out.0."),)
UNET_NAMES = ((".ff.expand.", ".ff.net.0.proj."), (".ff.contract.", ".ff.net.2."), *VAE_NAMES)
OLD_VAE_NAMES = (
    (".to_q.", ".query."),
    (".to_k.", ".key."),
    (".to_v.", ".value."),
    (".to_out.", ".proj_attn."),
)


def published(build) -> dict[str, np.ndarray]:
    """Pseudo-random arrays of a module under the names and in the shapes of checkpoints."""
    parameters = named_parameters(nnx.eval_shape(build))
    return weights(
        {published_name(n): published_shape(n, leaf.shape) for n, leaf in parameters.items()}
    )


def renamed(arrays: dict, *pairs: tuple[str, str]) -> dict:
    for old, new in pairs:
        arrays = {name.replace(old, new): array for name, array in arrays.items()}
    return arrays


def write_tokenizer(folder: Path, padding: str = "<|endoftext|>") -> int:
    """CLIP's files with single bytes as pieces; returns the number of pieces."""
    folder.mkdir(parents=True, exist_ok=True)
    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    pieces = [*letters, *(f"{letter}</w>" for letter in letters)]
    pieces += ["<|startoftext|>", "<|endoftext|>"]
    (folder / "vocab.json").write_text(json.dumps({p: i for i, p in enumerate(pieces)}))
    (folder / "merges.txt").write_text("#version: 0.2\n")
    (folder / "special_tokens_map.json").write_text(json.dumps({"pad_token": padding}))
    return len(pieces)


def write_json(path: Path, values: dict) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(values))


def stable_diffusion(folder: Path, layout: str = "plain", prediction: str = "epsilon") -> Path:
    """A diffusers folder. layout: "plain", "fp16", "sharded", or "old" names of the VAE."""
    text = TEXT | {"model_type": "clip_text_model"}
    text["vocab_size"] = write_tokenizer(folder / "tokenizer")
    write_json(folder / "text_encoder" / "config.json", text)
    write_json(folder / "unet" / "config.json", UNET)
    write_json(folder / "vae" / "config.json", VAE)
    scheduler = SCHEDULER | {"prediction_type": prediction}
    write_json(folder / "scheduler" / "scheduler_config.json", scheduler)

    config = clip_config.TextConfig.from_json(text, "tiny")
    tower = published(lambda: clip_text.TextTower(config))
    tower = {f"text_model.{name}": array for name, array in tower.items()}
    tower["text_model.embeddings.position_ids"] = np.arange(77)[None]
    network = published(lambda: unet.UNet(unet.UNetConfig.from_json(UNET, "tiny")))
    network = renamed(network, *UNET_NAMES)
    vae = autoencoder.AutoencoderConfig.from_json(VAE, "tiny")
    halves = published(lambda: autoencoder.Encoder(vae)) | published(
        lambda: autoencoder.Decoder(vae)
    )
    halves = renamed(halves, *(OLD_VAE_NAMES if layout == "old" else VAE_NAMES))
    for part, stem, arrays in (
        ("text_encoder", "model", tower),
        ("unet", "diffusion_pytorch_model", network),
        ("vae", "diffusion_pytorch_model", halves),
    ):
        write_arrays(folder / part, stem, arrays, layout)
    return folder


def write_arrays(folder: Path, stem: str, arrays: dict, layout: str) -> None:
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    if layout == "fp16":
        halves = {
            n: a.astype(np.float16) if a.dtype == np.float32 else a for n, a in arrays.items()
        }
        save_file(halves, folder / f"{stem}.fp16.safetensors")
    elif layout == "sharded":
        names, index = sorted(arrays), {}
        for number, part in enumerate((names[::2], names[1::2]), 1):
            shard = f"{stem}-{number:05d}-of-00002.safetensors"
            save_file({name: arrays[name] for name in part}, folder / shard)
            index |= dict.fromkeys(part, shard)
        write_json(folder / f"{stem}.safetensors.index.json", {"metadata": {}, "weight_map": index})
    else:
        save_file(arrays, folder / f"{stem}.safetensors")


def clip(folder: Path) -> Path:
    """A folder with both towers, as the CLIP that Point-E and the metrics use."""
    text = TEXT | {"vocab_size": write_tokenizer(folder)}
    values = {"model_type": "clip", "projection_dim": TOWER["projection_dim"]}
    values |= {"text_config": text, "vision_config": VISION}
    write_json(folder / "config.json", values)
    words = clip_config.TextConfig.from_json(values, "tiny")
    pictures = clip_config.VisionConfig.from_json(values, "tiny")
    arrays = published(lambda: clip_text.ClipText(words))
    arrays |= published(lambda: clip_vision.ClipVision(pictures))
    arrays["logit_scale"] = np.array(4.6, np.float32)
    save_file(arrays, folder / "model.safetensors")
    return folder


def save_torch_zip(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """A file as torch.save writes it for a dictionary of float32 tensors, without torch."""
    name = path.stem
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        content = _TorchPickle.state_dict(arrays)
        archive.writestr(f"{name}/data.pkl", content)
        archive.writestr(f"{name}/byteorder", "little")
        for number, array in enumerate(arrays.values()):
            data = np.ascontiguousarray(array, np.float32).tobytes()
            archive.writestr(f"{name}/data/{number}", data)
        archive.writestr(f"{name}/version", "3\n")


class _TorchPickle:
    """Pickle opcodes written one by one: there is no torch to pickle with."""

    @classmethod
    def state_dict(cls, arrays: dict[str, np.ndarray]) -> bytes:
        parts = [b"\x80\x02", b"ccollections\nOrderedDict\n", b")R("]
        for number, (name, array) in enumerate(arrays.items()):
            strides = [stride // array.itemsize for stride in np.empty(array.shape, "f4").strides]
            parts += [
                cls.text(name),
                b"ctorch._utils\n_rebuild_tensor_v2\n(",
                b"(" + cls.text("storage") + b"ctorch\nFloatStorage\n",
                cls.text(str(number)) + cls.text("cpu") + cls.whole(array.size) + b"tQ",
                cls.whole(0) + cls.tuple(array.shape) + cls.tuple(strides) + b"\x89",
                b"ccollections\nOrderedDict\n)RtR",
            ]
        return b"".join([*parts, b"u."])

    @staticmethod
    def text(value: str) -> bytes:
        data = value.encode()
        return b"X" + len(data).to_bytes(4, "little") + data

    @staticmethod
    def whole(value: int) -> bytes:
        return b"J" + value.to_bytes(4, "little")

    @classmethod
    def tuple(cls, values) -> bytes:
        return b"(" + b"".join(cls.whole(int(value)) for value in values) + b"t"


def point_e_files(folder: Path, suffix: str = ".pt") -> Path:
    """The base and the upsampler, narrow but for the numbers of points."""
    folder.mkdir(parents=True, exist_ok=True)
    small = point_e.PointEConfig(width=64, layers=1, heads=1, text=TOWER["projection_dim"])
    for stem, kind in (
        ("base_40m_textvec", point_e.PointEBase),
        ("upsample_40m", point_e.PointEUpsampler),
    ):
        arrays = published(lambda kind=kind: kind(small))
        if stem == "upsample_40m":
            arrays["channel_scales"] = np.float32([2, 2, 2, 1 / 127.5, 1 / 127.5, 1 / 127.5])
            arrays["channel_biases"] = np.float32([0, 0, 0, -1, -1, -1])
        if suffix == ".pt":
            save_torch_zip(folder / f"{stem}.pt", arrays)
        else:
            save_file(arrays, folder / f"{stem}{suffix}")
    return folder
