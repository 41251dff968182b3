"""The kinds, a family a module; importing one declares its kinds."""

from experiments.priors.models.families import (
    animals,
    creatures,
    food,
    fruit,
    kitchen,
    plants,
    sweets,
)

__all__ = ["animals", "creatures", "food", "fruit", "kitchen", "plants", "sweets"]
