"""What a run made, told to programs."""

import json
from pathlib import Path


def tell(folder: Path, as_json: bool) -> None:
    """Prints a run's folder as JSON: where it is, its files, its last frame's sums and its seconds.
    Without `as_json` nothing: standard output is for programs.
    """
    if not as_json:
        return
    last = (folder / "metrics.jsonl").read_text().splitlines()[-1]
    timing = json.loads((folder / "timing.json").read_text())
    files = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    told = {
        "folder": str(folder.absolute()),
        "files": [name for name in files if not name.startswith(".")],
        "last_frame": json.loads(last),
        "seconds": timing["stages"],
    }
    print(json.dumps(told, indent=2))
