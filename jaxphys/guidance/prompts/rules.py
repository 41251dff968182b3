"""Refinement without a language model: fixed rules, the same answer every time."""

import re

LONG = 14  # words; what is longer gets reduced
MOST_TRAITS = 6

# Words after which a description of the surroundings begins.
PLACES = (
    "on", "in", "at", "under", "against", "behind", "near", "beside", "inside", "outside",
    "amid", "surrounded", "during", "while", "beneath", "above", "next",
)  # fmt: skip
# With one of these before them, whatever follows is the surroundings.
POSTURES = {
    "sitting", "standing", "lying", "leaning", "parked", "placed", "floating", "resting", "hanging",
}  # fmt: skip
BETWEEN = {*PLACES, "between", "among", "over", "from", "upon"}
# What such a description speaks of; "in" alone may also say what the object holds or wears.
SURROUNDINGS = (
    "background", "table", "desk", "floor", "room", "kitchen", "forest", "beach", "garden",
    "field", "street", "city", "sky", "sunset", "sunlight", "light", "lighting", "morning",
    "evening", "night", "studio", "scene", "window", "wall", "grass", "snow", "rain", "shelf",
    "counter", "park", "house", "landscape", "backdrop", "setting", "countertop", "meadow",
    "river", "lake", "ocean", "sea", "mountain",
)  # fmt: skip
FILLER = {
    "a", "an", "the", "some", "very", "really", "extremely", "quite", "please", "of", "that",
    "which", "is", "are", "was", "has", "have", "having", "there", "image", "picture", "photo",
    "render", "rendering", "3d", "model", "create", "generate", "make", "me", "i", "want",
    "would", "like", "to", "see", "it", "its",
}  # fmt: skip
# What guidance needs to know of things that prompts often name, by their last word.
DETAILS = {
    "strawberry": "red heart-shaped fruit, small yellow seeds, green leafy cap, glossy surface",
    "rose": "layered spiral petals, green stem, pointed leaves, velvety surface",
    "ice-cream": "round scoop, crisp golden waffle cone, smooth creamy surface",
    "icecream": "round scoop, crisp golden waffle cone, smooth creamy surface",
    "nigiri": "slice of fish over an oblong bed of white rice, even grains, soft sheen",
    "pancakes": "stack of round golden-brown discs, soft edges, butter on top",
    "can": "upright metal cylinder, flat lid with tab, printed label, smooth shine",
    "microphone": "round metal mesh head, slim dark handle, matte body",
    "sponge": "yellow porous block, many small holes, rounded edges",
    "burger": "sesame bun, patty, lettuce, tomato and cheese layers, rounded top",
    "flowers": "bright petals, green stems, full bouquet",
    "bear": "round head, two round ears, stubby limbs, soft plush fur",
    "guitar": "curved wooden body, round sound hole, long neck, six strings",
    "apple": "round fruit, short brown stem, smooth shiny skin",
    "cake": "round layers, frosting, smooth sides",
    "chair": "four legs, flat seat, upright back",
    "cat": "pointed ears, long tail, soft fur",
    "dog": "floppy ears, four legs, soft fur",
    "duck": "round body, flat orange beak, small wings",
    "car": "four wheels, rounded body, windows",
}
GENERIC = "complete object, clear shape, natural colours, fine surface detail"


def _words(text: str) -> list[str]:
    return re.findall(r"[\w'-]+", text.lower())


def without_background(text: str) -> tuple[str, bool]:
    """The text without its clauses about surroundings, and whether there were any."""
    kept, removed = [], False
    for clause in re.split(r"[,;.]", text):
        words = clause.split()
        cut = len(words)
        for i, word in enumerate(words):
            tail = _words(" ".join(words[i:]))
            placed = word.lower() in PLACES and set(tail) & set(SURROUNDINGS)
            if placed or (word.lower() in POSTURES and set(tail[1:2]) & BETWEEN):
                cut = i
                break
        # "with a sunny background" and the like.
        if cut == len(words) and {"background", "backdrop"} & set(_words(clause)):
            cut = next((i for i, w in enumerate(words) if w.lower() in ("with", "and")), 0)
        removed |= cut < len(words)
        if words[:cut]:
            kept.append(" ".join(words[:cut]))
    return ", ".join(kept), removed


def _reduced(text: str) -> str:
    """The subject and at most a handful of traits of a long description, filler dropped."""
    clauses = re.split(r"[,;.]|\b(?:and|with|which|that|while)\b", text)
    traits: list[str] = []
    for clause in clauses:
        words = [word for word in re.findall(r"[\w'-]+", clause) if word.lower() not in FILLER]
        trait = " ".join(words[:5])
        if trait and trait.lower() not in [other.lower() for other in traits]:
            traits.append(trait)
    return ", ".join(traits[:MOST_TRAITS])


def _elaborated(text: str) -> str:
    known = [DETAILS[word] for word in dict.fromkeys(_words(text)) if word in DETAILS]
    return ", ".join([text, *known]) if known else f"{text}, {GENERIC}"


def refine_offline(prompt: str) -> tuple[str, str]:
    """The refined prompt, comma-separated, and the names of the rules that were applied."""
    text, removed = without_background(prompt)
    rules = ["background removed"] if removed else []
    if not _words(text):  # nothing but surroundings: then they are the object
        text, rules = prompt.strip(" ,.;"), []
    if len(_words(text)) > LONG:
        reduced = _reduced(text)
        text, rules = (reduced or text), [*rules, "reduced"]
    elif text.count(",") < 2:
        text, rules = _elaborated(text), [*rules, "elaborated"]
    return text, ", ".join(rules) or "unchanged"
