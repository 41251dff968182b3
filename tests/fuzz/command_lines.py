"""Command lines out of a grammar: every command, its flags, and values good and nasty."""

import os
from pathlib import Path
from random import Random

from tests.fuzz.mutations import NUMBERS

NUMBER = (*NUMBERS, "8", "12.5", "-7", "3", "1e400", "six")
TEXT = ("a can", "", " ", "\x1b[31m", "é", "x" * 2000, "bundled", "a\nb", "--", "jelly", "../..")
FLAGS = {
    "generate": {
        "--material": TEXT, "--config": "file", "--seed": NUMBER, "--width": NUMBER,
        "--height": NUMBER, "--frames": NUMBER, "--steps": NUMBER, "--splats": NUMBER,
        "--prior": TEXT, "--refiner": ("auto", "rules", "x"), "--attention-slice": NUMBER,
    },
    "image": {
        "--prior": TEXT, "--seed": NUMBER, "--steps": NUMBER, "--guidance": NUMBER,
        "--sampler": ("ddim", "x"), "--width": NUMBER, "--height": NUMBER,
    },
    "animate": {
        "--material": TEXT, "--config": "file", "--seed": NUMBER, "--width": NUMBER,
        "--height": NUMBER, "--frames": NUMBER, "--splats": NUMBER, "--substep": NUMBER,
        "--unsafe-dt": None, "--save-splats": None, "--tolerance": NUMBER,
    },
    "splat": {"--count": NUMBER, "--seed": NUMBER},
    "render": {
        "--azimuth": NUMBER, "--elevation": NUMBER, "--distance": NUMBER,
        "--field-of-view": NUMBER, "--width": NUMBER, "--height": NUMBER, "--views": NUMBER,
        "--background": NUMBER,
    },
    "export": {"--to": ("ply", "compressed-ply", "gltf", "spz", "usd", "x"),
               "--frames": (*NUMBER, "0:1", ":", "1:0")},
    "plan": {"--material": TEXT, "--object": "file", "--json": None, "--tolerance": NUMBER,
             "--no-measure": None},
    "materials": {"--json": None},
    "evaluate": {"--prompt": TEXT, "--frames": NUMBER, "--clip": "file"},
    "weights": {},
    "nonsense": {},
}  # fmt: skip
ACTIONS = ("list", "path smollm2", "path x", "verify x", "verify pixel_prior", "fetch x", "", "x y")
FILES = ("none.ply", "none.json", "pipe", "folder", "empty.ply", "empty.json", "empty.glb", "a.txt",
         "list.json", "no-splats.ply", "far.obj", "\x1b[31m.ply")  # fmt: skip
FIELDS = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
NO_SPLATS = "\n".join(
    [
        "ply\nformat ascii 1.0\nelement vertex 0",
        *(f"property float {name}" for name in FIELDS.split()),
        "end_header\n",
    ]
)


def furnish(folder: Path) -> None:
    """Writes the `FILES` that are there; none is of use to any command."""
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    for name in ("empty.ply", "empty.json", "empty.glb", "a.txt"):
        (folder / name).write_bytes(b"")
    (folder / "list.json").write_text("[1, 2]")
    (folder / "no-splats.ply").write_text(NO_SPLATS)
    (folder / "far.obj").write_text("v 0 0 0\nv 1e155 0 0\nv 0 1e155 0\nv 0 0 1e155\nf 1 2 3\n")


def command_line(folder: Path, random: Random) -> list[str]:
    """Arguments for `jaxphys`; none of them can succeed in making anything."""
    command = random.choice(list(FLAGS))
    if command == "weights":
        return [command, *random.choice(ACTIONS).split()]
    arguments = [command]
    if command in ("generate", "image"):
        arguments += [random.choice(("", " ", "\x1b[31m", "\0", "x" * 5000))]
    elif command not in ("materials", "plan") or random.random() < 0.8:
        arguments += [str(folder / random.choice(FILES))] if random.random() < 0.9 else []
    if command in ("generate", "image", "animate", "splat", "render", "export"):
        arguments += ["--out", str(folder / "out" / random.choice(("a", "a.png", "a.ply")))]
    flags = FLAGS[command]
    for flag in random.sample(list(flags), min(len(flags), random.choice((0, 1, 1, 2, 3)))):
        kind = flags[flag]
        arguments.append(flag)
        for _ in range(0 if kind is None else 3 if flag == "--background" else 1):
            value = str(folder / random.choice(FILES)) if kind == "file" else random.choice(kind)
            arguments.append(value)
    if command == "plan" and "--object" not in arguments:
        arguments += ["--object", str(folder / "none.ply")]
    if random.random() < 0.05:
        arguments.insert(random.randrange(len(arguments) + 1), random.choice(("--traceback", "-x")))
    return arguments
