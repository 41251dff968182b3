"""What a user of the twelve-prompt test writes; the scorer ranks these sentences as they stand."""

from experiments.priors.prompts import PROMPTS

# The user's words with an article; nigiri and pancakes as their captions have them everywhere.
SENTENCES = {
    "strawberry": "a strawberry",
    "rose": "a rose",
    "ice cream": "an ice cream",
    "nigiri": "a salmon nigiri",
    "pancakes": "a stack of pancakes",
    "can": "a can",
    "microphone": "a microphone",
    "sponge": "a sponge",
    "burger": "a burger",
    "vase with flowers": "a vase with flowers",
    "teddy bear": "a teddy bear",
    "guitar": "a guitar",
}

# The parametric model that makes what a prompt says, where their names differ.
MODEL_NAMES = {prompt: {"nigiri": "salmon nigiri"}.get(prompt, prompt) for prompt in PROMPTS}
