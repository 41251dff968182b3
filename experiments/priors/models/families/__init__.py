"""The kinds, a family a module; importing one declares its kinds."""

from experiments.priors.models.families import (
    animals,
    buildings,
    clothes,
    creatures,
    food,
    fruit,
    furniture,
    household,
    instruments,
    kitchen,
    nature,
    plants,
    sports,
    sweets,
    tools,
    toys,
    vehicles,
)

__all__ = ["animals", "buildings", "clothes", "creatures", "food", "fruit", "furniture", "household", "instruments", "kitchen", "nature", "plants", "sports", "sweets", "tools", "toys", "vehicles"]
