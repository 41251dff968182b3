"""LAION's aesthetic heads as `torch.save` writes them, the second with narrow hidden layers.

python -m experiments.parity.aesthetic_files     # writes tests/evaluate/golden; needs torch
"""

from pathlib import Path

import torch

from experiments.parity.arrays import weights
from experiments.parity.clip import DeepHead
from experiments.parity.clip_cases import LINEAR_HEAD
from jaxphys.evaluate.aesthetic import HEADS

FOLDER = Path(__file__).parents[2] / "tests" / "evaluate" / "golden"
NARROW = (768, 4, 3, 3, 2, 1)


def filled(head: torch.nn.Module) -> torch.nn.Module:
    """The head with the numbers that the tests expect."""
    shapes = {name: tuple(tensor.shape) for name, tensor in head.state_dict().items()}
    head.load_state_dict({n: torch.from_numpy(array) for n, array in weights(shapes).items()})
    return head


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    linear, deep = torch.nn.Linear(*reversed(LINEAR_HEAD["weight"])), DeepHead(NARROW)
    for version, head in (("v1", linear), ("v2", deep)):
        torch.save(filled(head).state_dict(), FOLDER / HEADS[version][1])


if __name__ == "__main__":
    main()
