"""Small files by PyTorch's own `torch.save`, for the reader that does without it.

python -m experiments.parity.torch_file     # writes tests/weights/golden; needs torch
"""

from pathlib import Path

import torch

from experiments.parity.arrays import pseudo_random

FOLDER = Path(__file__).parents[2] / "tests" / "weights" / "golden"


def state() -> dict:
    """Every kind of tensor that a checkpoint may hold; `norm` is a module's own dictionary."""
    base = torch.from_numpy(pseudo_random("base", (6, 8)))
    norm = torch.nn.BatchNorm1d(3)
    return {
        "norm": norm.state_dict(),
        "base": base,
        "transposed": base.T,
        "part": base[1:5:2, 3:],
        "parameter": torch.nn.Parameter(base[:2].clone()),
        "half": base.half(),
        "bfloat": base.bfloat16(),
        "double": base.double(),
        "scalar": torch.tensor(2.5),
        "empty": torch.zeros(0, 3),
        "nested": {"whole": torch.arange(4), "deeper": {"int": torch.arange(3, dtype=torch.int32)}},
        "mask": torch.tensor([True, False, True]),
        "bytes": torch.tensor([0, 127, 255], dtype=torch.uint8),
        "epoch": 3,
        "rate": 0.5,
        "note": "text",
        "shape": [1, (2, 3), None],
    }


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    torch.save(state(), FOLDER / "state.pt")
    torch.save(state(), FOLDER / "before_1_6.pt", _use_new_zipfile_serialization=False)
    torch.save(torch.nn.Linear(2, 2), FOLDER / "module.pt")
    torch.jit.save(torch.jit.script(torch.nn.Linear(2, 2)), FOLDER / "script.pt")


if __name__ == "__main__":
    main()
