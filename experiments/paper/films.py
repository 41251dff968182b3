"""The paper's figures of results and its table of scores, resolution and time."""

import time
from functools import partial
from statistics import mean

from experiments.lines import Cases, Line, markdown
from experiments.paper import guided, measures
from experiments.paper.methods import DREAM, METHODS, OURS, Method, scene_for
from experiments.paper.objects import MAKINGS, prompt_of
from experiments.paper.objects import OURS as MADE
from experiments.paper.run import Run
from experiments.paper.things import SHOWN, Shown, sentence_of
from jaxphys import animate
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.guidance import choice
from jaxphys.mpm.materials.catalogue import get_material
from jaxphys.scene.build import build

SEED = 0  # of the objects that are filmed
# The paper's table: LAION aesthetic score, CLIP score, resolution, minutes on an RTX 3090.
PAPER = {
    OURS.name: ("ours", 3.80, 0.278, "1958x1090", 1.7),
    DREAM.name: ("DreamPhysics", 3.77, 0.269, "800x800", 3.58),
    "Feature-Splatting-like": ("Feature Splatting", 1.98, 0.268, "512x512", 6.57),
}


def cases(run: Run) -> Cases:
    """Ours of all that is shown first, then the other methods'."""
    found = {}
    for method in METHODS:
        for title in run.size.shown if method == OURS else run.size.compared:
            if method.knows(SHOWN[title]):
                found[f"film: {method.name}: {title}"] = partial(film, run, method, title)
    return found


def film(run: Run, method: Method, title: str) -> Line:
    """Films an object, which is made first where it is not there."""
    shown, size = SHOWN[title], run.size
    thing = run.thing(shown.name, SEED)
    folder = run.film_folder(method.name, title)
    resumed = folder.exists()
    begin, used = time.perf_counter(), time.process_time()
    found = None
    if method.guided:
        found = moduli(run, method, shown, thing)
    scene = scene_for(
        method,
        shown,
        stiffness=None if found is None else found[-1],
        spacing=size.spacing,
        frames=size.frames,
        scale=size.scale,
    )
    animate(scene, folder, objects=(thing,), save_splats=True, overwrite=True)
    spent = [time.perf_counter() - begin, time.process_time() - used]
    line: Line = {
        "method": method.name,
        "title": title,
        "material": shown.material,
        "size": size.name,
        "resolution": f"{scene.width}x{scene.height}",
        "frames": scene.frames,
        "nodes": list(scene.domain.shape),
        # Of the motion alone, by the clock and of all cores, compiling included.
        "spent": [round(seconds, 1) for seconds in spent],
        # What a kill left was not done again: then these are not of the whole.
        "resumed": resumed,
        **measures.of_film(folder, shown.name),
    }
    if found is not None:
        line["moduli"] = [round(modulus, 1) for modulus in found]
    return line


def moduli(run: Run, method: Method, shown: Shown, thing: Gaussians) -> list[float]:
    """What guidance finds from the material's own modulus on [Pa], see `guided.stiffness`."""
    scene = scene_for(method, shown, spacing=run.size.spacing)
    simulation, look = build(scene, thing)
    return guided.stiffness(
        simulation,
        look,
        choice.guides(prompt_of(shown.name, MAKINGS[MADE])).image,
        get_material(shown.material).defaults["youngs_modulus"],
        seconds=scene.seconds_per_frame * (scene.frames - 1),
        size=scene.objects[0].size,
        seed=SEED,
        search=guided.Search(steps=run.size.search),
    )


def _of(lines: list[Line]) -> list[Line]:
    return [line for line in lines if line["case"].startswith("film: ") and line["status"] == "ok"]


def main_table(lines: list[Line]) -> str:
    """What is filmed by ours."""
    rows = [
        (
            line["title"],
            f"*{sentence_of(SHOWN[line['title']].name)}*",
            line["material"],
            line["resolution"],
            line["frames"],
            "x".join(map(str, line["nodes"])),
            _minutes([line]),
        )
        for line in _of(lines)
        if line["method"] == OURS.name
    ]
    head = ("film", "sentence", "material", "pixels", "pictures", "grid nodes", "minutes (CPU)")
    return markdown(head, rows)


def method_table(lines: list[Line]) -> str:
    """Means over each method's films, beside what the paper has of the method it stands for."""
    rows: list[tuple] = []
    for method in METHODS:
        made = [line for line in _of(lines) if line["method"] == method.name]
        told, laion, clip, pixels, minutes = PAPER[method.name]
        rows.append((f"{told}, the paper's", "", laion, clip, "", "", "", pixels, minutes))
        if not made:
            continue
        rows.append(
            (
                f"**{method.name}**, here",
                len(made),
                _published(made, "laion"),
                _published(made, "clip"),
                f"{mean(line['cosine'] for line in made):.3f}",
                f"{mean(line['saturation'] for line in made):.3f}",
                f"{mean(line['change'] for line in made):.2f}",
                ", ".join(sorted({line["resolution"] for line in made})),
                _minutes(made),
            )
        )
    head = (
        *("method", "films", "LAION", "CLIP"),
        *("our scorer", "saturation", "change", "pixels", "minutes (CPU)"),
    )
    return markdown(head, rows)


def _minutes(lines: list[Line]) -> str:
    """The mean time of films that were made in one go, and in parentheses that of all cores."""
    whole = [line["spent"] for line in lines if not line["resumed"]]
    if not whole:
        return "resumed"
    clock, cores = (mean(column) / 60 for column in zip(*whole, strict=True))
    return f"{clock:.2f} ({cores:.2f})"


def _published(lines: list[Line], name: str) -> str:
    """A published score's mean, where all films have it."""
    values = [line[name] for line in lines if name in line]
    return f"{mean(values):.3f}" if len(values) == len(lines) else "no weights"


def film_table(lines: list[Line]) -> str:
    """Film by film: each method's change, saturation and the scorer's cosine."""
    by = {(line["title"], line["method"]): line for line in _of(lines)}
    rows = []
    for title in dict.fromkeys(title for title, _ in by):
        row: list = [title]
        for name in ("cosine", "saturation", "change"):
            values = [by.get((title, method.name)) for method in METHODS]
            row.append(" / ".join(f"{v[name]:.3g}" if v else "-" for v in values))
        found = by.get((title, DREAM.name))
        ends = [found["moduli"][0], found["moduli"][-1]] if found else []
        row.append(" to ".join(f"{end:.3g}" for end in ends) or "-")
        rows.append(tuple(row))
    names = " / ".join(method.name for method in METHODS)
    text = markdown(("film", "our scorer", "saturation", "change", "modulus found [Pa]"), rows)
    return f"Each cell: {names}.\n\n{text}"
