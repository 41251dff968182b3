"""`jaxphys fit` killed at random moments, and run again, ends in the same bytes.

Each case kills (SIGKILL: nothing is tidied up) one fit so many times, at moments drawn between its
start and its end, then lets it finish and compares its files with those of a fit that was left
alone.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import jax
import numpy as np

from experiments.fitting.scenes import STEPS, scene_of, solid
from experiments.lines import Cases, Line, markdown
from jaxphys.fitting import motion_at
from jaxphys.gaussians.ply import write_ply
from jaxphys.scene.build import build
from jaxphys.scene.json import to_json

TIMES = np.arange(8) / 24
TRUE = {"youngs_modulus": 3e4, "poisson_ratio": 0.3}
KILLS, SEED = 10, 6


def prepared(folder: Path, cells: int) -> Path:
    """A config and what it names; a fit of it starts elsewhere."""
    scene = scene_of("elastic", {"density": 1000.0}, law="neo-Hookean", floor="separate")
    thing = solid("block", cells)
    simulation = build(scene, thing).simulation
    run = jax.jit(partial(motion_at, times=tuple(TIMES.tolist()), steps=STEPS))
    motion = jax.device_get(run(simulation.with_(**TRUE, velocity=(0.3, 0.0, -1.0)))).check()
    random = np.random.default_rng(SEED)
    places = motion.position + 5e-4 * random.normal(size=motion.position.shape)
    np.savez(folder / "tracks.npz", positions=places, times=motion.time)
    write_ply(folder / "block.ply", thing)
    written = to_json(scene)
    written["objects"][0]["source"] = "block.ply"
    (folder / "scene.json").write_text(json.dumps(written))
    config = {
        "scene": "scene.json",
        "free": {
            "youngs_modulus": {"type": "log", "start": 1e4},
            "poisson_ratio": {"type": "bounded", "start": 0.2, "low": 0.0, "high": 0.45},
            "velocity": {"type": "free", "start": [0.0, 0.0, -0.5]},
        },
        "observed": [{"type": "tracks", "file": "tracks.npz", "noise": 5e-4}],
    }
    (folder / "fit.json").write_text(json.dumps(config))
    return folder / "fit.json"


def files_of(folder: Path) -> dict[str, bytes]:
    """What a run left, by name; hidden files are its own book-keeping."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in files
        if not any(part.startswith(".") for part in path.relative_to(folder).parts)
    }


def begun(config: Path, out: Path) -> subprocess.Popen:
    """The command, in a process of its own."""
    command = [sys.executable, "-m", "jaxphys", "fit", str(config), "--out", str(out)]
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=os.environ.copy()
    )


def finished(process: subprocess.Popen) -> None:
    """Waits for a command; raises RuntimeError with what it said where it failed."""
    _, said = process.communicate()
    if process.returncode:
        raise RuntimeError(said.decode()[-2000:])


def case(kills: int, cells: int) -> Line:
    """A fit that is left alone and one that is killed."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        config = prepared(folder, cells)
        begin = time.monotonic()
        finished(begun(config, folder / "whole"))
        whole = time.monotonic() - begin
        random, landed = np.random.default_rng(SEED), 0
        for moment in random.uniform(0.02, 0.98, kills) * whole:
            process = begun(config, folder / "killed")
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                process.kill()
                landed += 1
            process.communicate()
        finished(begun(config, folder / "killed"))
        one, other = files_of(folder / "whole"), files_of(folder / "killed")
        differ = sorted(name for name in one | other if one.get(name) != other.get(name))
        return {
            "kills": landed,
            "files": sorted(one),
            "differ": differ,
            "found": json.loads(one["result.json"])["values"],
            "uninterrupted_seconds": round(whole, 1),
        }


def cases(quick: bool) -> Cases:
    """The one; quick: killed twice, coarse."""
    return {"kill": partial(case, 2, 4) if quick else partial(case, KILLS, 6)}


def table(lines: list[Line]) -> str:
    """What was killed, and what differed."""
    rows = [
        (line["kills"], ", ".join(f"`{name}`" for name in line["files"]),
         ", ".join(line["differ"]) or "none")
        for line in lines
        if line["status"] == "ok"
    ]  # fmt: skip
    return markdown(("times killed", "files", "that differ"), rows)
