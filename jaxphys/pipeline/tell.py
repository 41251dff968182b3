"""What the report in a run's folder tells of it, gathered as the run ends."""

from collections.abc import Mapping
from typing import Any

from jaxphys.core.errors import shortened
from jaxphys.page.report import NAME, Told, report_page
from jaxphys.pipeline.plan import as_text, describe
from jaxphys.pipeline.videos import facts_of, title_of
from jaxphys.scene.build import Built
from jaxphys.scene.scene import Scene

__all__ = ["NAME", "report_of"]
LONGEST_TITLE = 200


def report_of(scene: Scene, built: Built, metrics: list[dict], prompt: Mapping[str, Any]) -> str:
    """The report of a run. Equal runs get equal ones: it holds no seconds and no place.

    Args:
        scene: as config.json has it.
        built: of the scene.
        metrics: of each frame.
        prompt: what prompt.json holds, {} where nothing was generated.
    """
    materials = " and ".join(dict.fromkeys(thing.material for thing in scene.objects))
    facts = facts_of(scene, prompt)
    simulation, look = built
    facts["Gaussians"] = f"{look.gaussians.count} that move"
    facts["Particles"] = str(simulation.config.particles)
    if metrics:
        facts["Steps"] = str(metrics[-1]["steps"])
    return report_page(
        Told(
            title=shortened(title_of(scene, f"An object of {materials}"), LONGEST_TITLE),
            facts=facts,
            metrics=metrics,
            gravity=scene.gravity,
            plan=as_text(describe(scene, built)),
            commands=_commands(scene),
        )
    )


def _commands(scene: Scene) -> list[str]:
    """From inside the folder: the motion, and all of it where a sentence was the start."""
    lines = ["jaxphys animate --config config.json --out AGAIN      # the motion, to the byte"]
    if scene.generation is not None:
        lines.append("jaxphys generate --config config.json --out AGAIN     # the object too")
    lines.append("jaxphys plan config.json                              # what it would do and why")
    return lines
