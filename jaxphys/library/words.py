"""Captions: what is seen, in the several ways in which people and refined prompts say it.

What is unusual is always said; what is usual (a yellow rubber duck) and the defaults sometimes. A
caption that names no colour therefore goes with the usual ones.
"""

from collections.abc import Set

import numpy as np

from jaxphys.library.kinds import COUNTS, Kind
from jaxphys.library.palette import COLOURS, article
from jaxphys.library.patterns import STYLES
from jaxphys.library.variation import Choice

# Names of parts without an article.
MASS = {
    "hair", "fur", "icing", "cream", "rice", "sauce", "lettuce", "cheese", "snow", "trim", "piping",
    "wool", "skin", "foam", "water", "coffee", "soup", "milk", "butter", "syrup", "bread", "crust",
    "foliage", "straw", "glass", "sand", "chocolate", "jam", "frosting", "filling", "bark", "meat",
    "plumage", "grass", "earth", "fabric", "upholstery", "soil", "seaweed", "fish", "wood",
    "whipped cream", "ice", "ham", "bacon", "dough", "wax", "juice", "tea", "flesh", "paint",
}  # fmt: skip
ENDS_IN_S = {
    "bus", "cactus", "octopus", "glass", "dress", "cross", "compass", "lens", "moss", "grass",
}  # fmt: skip
FINISHES = (
    "complete object, clear shape", "fine surface detail", "smooth surface", "soft edges", "glossy",
    "simple shapes", "clean lines", "matte finish", "high detail",
)  # fmt: skip
QUIET = 0.45  # chance that a caption says nothing that goes without saying, else
SAID_WHOLE, SAID_PART, SAID_EXTRA = 0.35, 0.2, 0.7  # chances to say a colour, another, an extra
IRREGULAR = {"leaves": "leaf", "berries": "berry", "branches": "branch", "shelves": "shelf"}
IRREGULAR |= {"cherries": "cherry", "patties": "patty", "candies": "candy", "arches": "arch"}


def is_plural(noun: str) -> bool:
    """Whether the head of a noun phrase is a plural: "pancakes", not "stack of pancakes"."""
    head = noun.split(" of ")[0].split(" with ")[0].split()[-1]
    return head in ("feet", "teeth") or (head.endswith("s") and head not in ENDS_IN_S)


def singular(noun: str) -> str:
    return IRREGULAR.get(noun, noun.removesuffix("s"))


def with_article(phrase: str, noun: str) -> str:
    """The phrase that ends in `noun`, with an article if it takes one."""
    return phrase if is_plural(noun) or noun in MASS else article(phrase)


def called(kind: Kind, choice: Choice, part: str) -> str:
    """A part's name as it is said: the pattern's is what it consists of."""
    if part == "pattern":
        return next(STYLES[value] for value in choice.values.values() if value in STYLES)
    return part.replace("_", " ")


class Said:
    """What one caption says: adjectives of the whole, its colour, phrases about parts."""

    def __init__(self, kind: Kind, choice: Choice, present: Set[str], rng: np.random.Generator):
        self.adjectives: list[str] = []
        self.parts: dict[str, list[str]] = {}  # name as said -> adjectives, or a count alone
        self.colour = ""
        quiet = rng.random() < QUIET

        def worth(chance: float) -> bool:
            return not quiet and rng.random() < chance

        for name, option in kind.options.items():
            word = choice.words[name]
            if option.type == "form" and word and ("" in option.values or worth(SAID_EXTRA)):
                self.adjectives.append(word)
            elif option.type == "size" and word:
                self.parts[name.replace("_", " ")] = [word]
            elif option.type == "extra" and word and worth(SAID_EXTRA):
                self.parts.setdefault(name.replace("_", " "), [])
            elif option.type == "count" and worth(SAID_EXTRA):
                self.parts[name.replace("_", " ")] = [word]
        for part, colour in choice.colours.items():
            if part not in present:
                continue
            said = part in choice.unusual
            if part == kind.main:
                self.colour = colour if said or worth(SAID_WHOLE) else ""
            elif said or (part not in kind.fixed and worth(SAID_PART)):
                self.parts.setdefault(called(kind, choice, part), []).append(colour)

    def phrases(self, articles: bool) -> list[str]:
        found = []
        for name, words in self.parts.items():
            noun = singular(name) if words and words[0] == "one" else name
            phrase = " ".join([*words, noun])
            counted = bool(words) and words[0] in COUNTS
            found.append(with_article(phrase, noun) if articles and not counted else phrase)
        return found


def listing(phrases: list[str]) -> str:
    return phrases[0] if len(phrases) == 1 else f"{', '.join(phrases[:-1])} and {phrases[-1]}"


COLOUR_WORDS = {word for name in COLOURS for word in name.split()} | {"gold"}


def nouns_for(kind: Kind, colour: str, said: str) -> list[str]:
    """What a thing of this colour may be called: "brown bear" if it is brown and nobody says so."""

    def fits(noun: str) -> bool:
        words = COLOUR_WORDS.intersection(noun.split())
        return not words or (not said and words <= {colour, colour.removesuffix("en")})

    return [kind.name, *filter(fits, kind.also)]


def caption(kind: Kind, choice: Choice, present: Set[str], rng: np.random.Generator) -> str:
    """One caption of a variant of which the parts `present` are there."""
    said = Said(kind, choice, present, rng)
    nouns = nouns_for(kind, choice.colours[kind.main], said.colour)
    noun = kind.name if rng.random() < 0.6 else str(rng.choice(nouns))
    style = rng.random()
    bare = rng.random() < 0.15
    head = noun if bare else with_article(noun, noun)
    if style < 0.6:  # a sentence
        whole = " ".join([*said.adjectives, *filter(None, [said.colour]), noun])
        text = whole if bare else with_article(whole, noun)
        phrases = said.phrases(articles=True)
        if not phrases:
            return text
        return f"{text}{', ' if ' with ' in noun else ' with '}{listing(phrases)}"
    if style < 0.8:  # everything behind commas
        traits = [said.colour, *said.adjectives, *said.phrases(articles=style < 0.7)]
        if said.parts and rng.random() < 0.3:
            traits = [said.colour, *said.adjectives]
            traits += [f"with {phrase}" for phrase in said.phrases(articles=True)]
    else:  # a refined prompt: the whole at once, its parts behind commas
        whole = " ".join([*said.adjectives, *filter(None, [said.colour]), noun])
        head, traits = with_article(whole, noun), said.phrases(articles=False)
        if rng.random() < 0.5:
            traits = [*traits, *rng.choice(FINISHES, rng.integers(1, 3), replace=False)]
    return ", ".join([head, *filter(None, map(str, traits))])
