"""The kinds, a family a module; importing one declares its kinds."""

from experiments.priors.models.families import (
    animals,
    buildings,
    creatures,
    food,
    fruit,
    furniture,
    household,
    kitchen,
    plants,
    sweets,
    tools,
    vehicles,
)

__all__ = ["animals", "buildings", "creatures", "food", "fruit", "furniture", "household", "kitchen", "plants", "sweets", "tools", "vehicles"]
