"""The 3D prior that comes with the package: over latents of surfaces where those are trained, else
over points."""

from jaxphys import weights
from jaxphys.guidance.bundled.latent_guide import bundled_latent_guide
from jaxphys.guidance.bundled.point_guide import bundled_point_guide
from jaxphys.guidance.guides import ShapeGuide

LATENT = ("shape_autoencoder", "latent_prior")
POINT = ("point_prior",)


def shape_weights() -> tuple[str, ...]:
    """The names of the weights that the bundled 3D prior needs."""
    return LATENT if all(name in weights.manifest() for name in LATENT) else POINT


def bundled_shape_guide(prompt: str) -> ShapeGuide:
    """The bundled 3D prior, told a refined prompt.

    Raises InputError if its weights are missing or damaged.
    """
    if shape_weights() == LATENT:
        return bundled_latent_guide(prompt)
    return bundled_point_guide(prompt)
