"""The paper's evaluation: its films, tables and ablations, and one page of it all.

    python -m experiments.paper --out outputs/paper             # hours on two cores
    python -m experiments.paper --out outputs/paper --quick     # 22 minutes of CPU or so
    python -m experiments.paper --table benchmarks/lines/paper-quick.jsonl
    python -m experiments.paper --out outputs/paper --page      # from the films that are there

A run goes on where it was stopped: what has a line in OUT/full/lines.jsonl or OUT/quick/lines.jsonl
is not done again. It ends with tables.md and videos.html beside these.
"""

import argparse
from functools import partial
from pathlib import Path

import jax

from experiments import lines
from experiments.paper import ablation, films, objects
from experiments.paper.methods import METHODS, OURS
from experiments.paper.run import FULL, QUICK, Run
from experiments.paper.things import SHOWN
from experiments.showcase import small_sheet
from jaxphys.core.errors import InputError
from jaxphys.core.files import atomic_path
from jaxphys.pipeline.replay import NEEDED
from jaxphys.pipeline.videos import write_videos

LINES, PAGE, TABLES, COMPILED = "lines.jsonl", "videos.html", "tables.md", "compiled"


def cases(run: Run) -> lines.Cases:
    """The objects that are filmed, the films, then the ablations."""
    filmed = {
        ablation.object_case(name, films.SEED, objects.OURS): partial(
            ablation.measured, run, name, films.SEED, objects.OURS
        )
        for name in (SHOWN[title].name for title in run.size.shown)
    }
    return {**filmed, **films.cases(run), **ablation.cases(run)}


def tables(found: list[lines.Line]) -> str:
    """All tables of some lines, in Markdown."""
    sizes = sorted({line["size"] for line in found if "size" in line})
    machines = sorted({f"{line['cores']} cores of {line['processor']}" for line in found})
    failed = [line for line in found if line["status"] != "ok"]
    parts = [
        f"From {len(found)} lines of the {' and the '.join(sizes)} run; {'; '.join(machines)}.",
        *(f"Failed: {line['case']}: {line['reason']}" for line in failed),
        "## Films\n\n" + films.main_table(found),
        "## Scores, resolution and time\n\n" + films.method_table(found),
        films.film_table(found),
        "## Ablations\n\n" + ablation.table(found),
    ]
    return "\n\n".join(parts) + "\n"


def finished(run: Run) -> dict[Path, str]:
    """The folders of finished films and their titles on the page, ours beside the others'."""
    found = {}
    for title in run.size.shown:
        for method in METHODS:
            folder = run.film_folder(method.name, title)
            if all((folder / name).is_file() for name in NEEDED):
                found[folder] = f"{title[0].upper()}{title[1:]}, {method.name}"
    return found


def write_page(run: Run) -> Path:
    """One page of the films that are finished."""
    found = finished(run)
    if not found:
        raise InputError(f"{run.out}: holds no finished film yet; run without --page first")
    return write_videos(
        list(found),
        run.out / PAGE,
        title="Text to 3D to motion: the paper's films with the parts that are here",
        titles=list(found.values()),
        megabytes=run.size.megabytes,
        overwrite=True,
    )


def keep_compiled(folder: Path) -> None:
    """Keeps compiled programs there, unless they are kept somewhere already: objects share them."""
    if jax.config.jax_compilation_cache_dir is None:
        jax.config.update("jax_compilation_cache_dir", str(folder))


def main(arguments: list[str] | None = None) -> None:
    """Runs what is lacking, and writes tables and page; or one of these alone."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.paper", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--out", type=Path, help="folder of all that is made")
    parser.add_argument("--quick", action="store_true", help="few objects, small and short")
    parser.add_argument("--only", default="", help="cases with this in their name")
    parser.add_argument("--table", type=Path, help="print the tables of these lines instead")
    parser.add_argument("--page", action="store_true", help="write the page and nothing else")
    parser.add_argument("--sheets", type=Path, help="small contact sheets of our films, here")
    options = parser.parse_args(arguments)
    if options.table is not None:
        print(tables(lines.read(options.table)), end="")
        return
    if options.out is None:
        parser.error("give --out or --table")
    size = QUICK if options.quick else FULL
    run = Run(options.out / size.name, size)
    if not options.page:
        keep_compiled(run.out / COMPILED)
        wanted = {name: case for name, case in cases(run).items() if options.only in name}
        lines.run(wanted, run.out / LINES)
        with atomic_path(run.out / TABLES) as aside:
            aside.write_text(tables(lines.read(run.out / LINES)))
    if options.page or finished(run):
        print(write_page(run))
    if options.sheets is not None:
        for folder in finished(run):
            if folder == run.film_folder(OURS.name, folder.name.replace("-", " ")):
                small_sheet(folder, options.sheets / f"paper-{folder.name}.jpg")


if __name__ == "__main__":
    main()
