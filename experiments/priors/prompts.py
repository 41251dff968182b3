"""The prompts whose samples a training run draws into its progress pictures."""

PROMPTS = (
    "strawberry",
    "rose",
    "ice cream",
    "nigiri",
    "pancakes",
    "can",
    "microphone",
    "sponge",
    "burger",
    "vase with flowers",
    "teddy bear",
    "guitar",
)
# Attributes, the later ones of them in combinations that training never shows.
ATTRIBUTES = (
    "a white teapot",
    "a blue teapot",
    "a teapot with a long spout",
    "a rubber duck",
    "a green rubber duck",
    "a purple mug with a yellow handle",
    "a cake with three layers",
    "a pink car",
)
