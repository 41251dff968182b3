"""A small random CLIP on disk, laid out as the published one."""

import json
from pathlib import Path

import numpy as np
import pytest
from flax import nnx
from safetensors.numpy import save_file

from experiments.parity import clip_cases as cases
from experiments.parity import clip_tokenizer
from experiments.parity.arrays import weights
from jaxphys.networks.clip_config import TextConfig, VisionConfig
from jaxphys.networks.clip_text import ClipText
from jaxphys.networks.clip_vision import ClipVision
from jaxphys.networks.parameters import named_parameters, published_name, published_shape


@pytest.fixture(scope="session")
def clip_folder(tmp_path_factory) -> Path:
    """`cases.SCORED`, whose cosines transformers knows (`clip_cosines.npz`)."""
    merges = json.loads(clip_tokenizer.GOLDEN.read_text())["merges"]
    folder = clip_tokenizer.write_folder(
        tmp_path_factory.mktemp("clip"), merges, clip_tokenizer.STYLES["end"]
    )
    (folder / "config.json").write_text(json.dumps(cases.SCORED))
    shapes = {"logit_scale": ()}
    for config, module in ((TextConfig, ClipText), (VisionConfig, ClipVision)):
        tower = nnx.eval_shape(
            lambda config=config, module=module: module(config.from_json(cases.SCORED, "small"))
        )
        for name, leaf in named_parameters(tower).items():
            shapes[published_name(name)] = published_shape(name, leaf.shape)
    buffers = {
        "text_model.embeddings.position_ids": np.arange(77)[None],
        "vision_model.embeddings.position_ids": np.arange(5)[None],
    }
    save_file(weights(shapes) | buffers, folder / "model.safetensors")
    return folder
