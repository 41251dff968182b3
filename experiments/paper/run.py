"""How much is run, and where it goes."""

from dataclasses import dataclass
from pathlib import Path

from experiments.paper import objects, things
from experiments.scorer.sentences import SENTENCES
from jaxphys.gaussians.gaussians import Gaussians
from jaxphys.gaussians.ply import read_ply, write_ply
from jaxphys.scene.defaults import SPACING


@dataclass(frozen=True)
class Size:
    """How much is run.

    Attributes:
        name: which lines it makes; lines of different sizes do not mix.
        shown: titles in `things.SHOWN` that are filmed by ours.
        compared: those of them that the other methods film too.
        ablated: names of objects for the ablations; seeds: of each.
        scale: of the pictures' sides; frames: of a film, None: as the scene has it.
        spacing: of the grid [m].
        steps: of distillation, None: as usual.
        search: steps that look for a stiffness.
        megabytes: of a motion on the page.
    """

    name: str
    shown: tuple[str, ...]
    compared: tuple[str, ...]
    ablated: tuple[str, ...]
    seeds: tuple[int, ...]
    scale: float = 1.0
    frames: int | None = None
    spacing: float = SPACING
    steps: int | None = None
    search: int = 30
    megabytes: float = 4.0


FULL = Size(
    name="full",
    shown=tuple(things.SHOWN),
    compared=tuple(things.SHOWN),
    ablated=tuple(SENTENCES),
    seeds=(0, 1),
)
QUICK = Size(
    name="quick",
    shown=tuple(things.MAIN),
    compared=("elastic burger",),
    ablated=("burger", "can"),
    seeds=(0,),
    scale=0.2,
    frames=16,
    spacing=1 / 14,
    steps=16,
    search=4,
    megabytes=1.0,
)


@dataclass(frozen=True)
class Run:
    """A run of everything.

    Attributes:
        out: its folder; size: how much.
    """

    out: Path
    size: Size

    def film_folder(self, method: str, title: str) -> Path:
        """Where a film is."""
        return self.out / "films" / method / title.replace(" ", "-")

    def thing(self, name: str, seed: int, how: str = objects.OURS) -> Gaussians:
        """An object by one of `objects.MAKINGS`, made where it was not yet."""
        folder = self.out / "objects" / how.replace(",", "").replace(" ", "-")
        path = folder / f"{name.replace(' ', '-')}-{seed}.ply"
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            write_ply(path, objects.make(name, seed, objects.MAKINGS[how], self.size.steps))
        return read_ply(path)
