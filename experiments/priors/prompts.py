"""The prompts whose samples a training run draws into its progress pictures."""

import json
from pathlib import Path

import numpy as np

PROMPTS = (
    "strawberry",
    "rose",
    "ice cream",
    "nigiri",
    "pancakes",
    "can",
    "microphone",
    "sponge",
    "burger",
    "vase with flowers",
    "teddy bear",
    "guitar",
)


def embeddings(folder: Path) -> np.ndarray:
    """(12, D): of each prompt the shortest caption of the data that holds its words."""
    captions = json.loads((folder / "captions.json").read_text())
    vectors = np.load(folder / "text_embeddings.npy")
    rows = []
    for prompt in PROMPTS:
        holds = [i for i, c in enumerate(captions) if all(w in c.lower() for w in prompt.split())]
        rows.append(min(holds, key=lambda i: len(captions[i])) if holds else 0)
    return vectors[rows]
