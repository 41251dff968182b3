"""What PyTorch's own code computes with small pseudo-random weights, as files for the tests.

    python -m experiments.parity            # writes tests/networks/golden and .../manifests
    python -m experiments.parity --check    # compares with what is there; status 1 if it differs

Needs torch, diffusers and transformers; the tests that read the files do not.
"""

import argparse
import importlib
import json
import sys
from pathlib import Path

import numpy as np

MODELS = ("stable_diffusion", "sampling", "clip", "point_e", "llama")
ROOT = Path(__file__).parents[2] / "tests" / "networks"
TOLERANCE = 1e-5  # relative to the largest entry: between versions and machines


def _same(found: dict[str, np.ndarray], path: Path) -> bool:
    if not path.exists():
        return False
    with np.load(path) as known:
        if set(known) != set(found):
            return False
        return all(
            known[name].shape == value.shape
            and np.max(np.abs(known[name] - value), initial=0)
            <= TOLERANCE * max(np.max(np.abs(value), initial=0), 1e-30)
            for name, value in found.items()
        )


def main() -> int:
    """Every model's `GOLDEN` and `MANIFESTS`: functions by the name of the file that they fill."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing, compare")
    parser.add_argument("--only", choices=MODELS, help="one model")
    asked = parser.parse_args()
    wrong = []
    for model in [asked.only] if asked.only else MODELS:
        module = importlib.import_module(f"experiments.parity.{model}")
        for name, compute in module.GOLDEN.items():
            path, arrays = ROOT / "golden" / f"{name}.npz", compute()
            if asked.check:
                wrong += [] if _same(arrays, path) else [path.name]
            else:
                np.savez_compressed(path, **arrays)
        for name, compute in module.MANIFESTS.items():
            path = ROOT / "manifests" / f"{name}.json"
            lines = [f"{json.dumps(k)}: {json.dumps(list(s))}" for k, s in compute().items()]
            text = "{\n" + ",\n".join(lines) + "\n}\n"
            if asked.check:
                wrong += [] if path.exists() and path.read_text() == text else [path.name]
            else:
                path.write_text(text)
        print(f"{model}: done", flush=True)
    if wrong:
        print(f"differs from the committed files: {', '.join(wrong)}", file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
