"""Words for the colours that are seen on an object of which only the colours are known."""

import numpy as np

from jaxphys.library.palette import COLOURS, article

# Materials look like one of these: a picture does not tell copper from brown.
NAMES = (
    "red", "dark red", "orange", "yellow", "green", "dark green", "light green", "blue",
    "dark blue", "light blue", "turquoise", "purple", "pink", "white", "cream", "light grey",
    "grey", "dark grey", "black", "brown", "light brown", "dark brown", "beige",
)  # fmt: skip
MOST, SOME = 0.45, 0.15  # shares of the surface from which a colour is the whole's, or worth a word


def opponent(colours: np.ndarray) -> np.ndarray:
    """Colours (N, 3) as lightness, red-green and yellow-blue, in which tint counts twice."""
    red, green, blue = np.asarray(colours, float).T
    return np.stack([(red + green + blue) / 3, red - green, 0.5 * (red + green) - blue], -1) * (
        1.0, 1.4, 1.4,
    )  # fmt: skip


def seen(colours: np.ndarray) -> list[tuple[str, float]]:
    """The names of the colours of samples (N, 3) in [0, 1] and their shares, largest first."""
    table = opponent(np.array([COLOURS[name] for name in NAMES]))
    distance = ((opponent(colours)[:, None] - table) ** 2).sum(-1)
    share = np.bincount(distance.argmin(1), minlength=len(NAMES)) / len(colours)
    return [(NAMES[k], float(share[k])) for k in np.argsort(-share) if share[k] > 0]


def colour_captions(name: str, plural: bool, colours: np.ndarray) -> list[str]:
    """Ways to say the name with the colours seen; none if there is no clear one."""
    found = seen(colours)
    first, share = found[0]
    second = found[1][0] if len(found) > 1 and found[1][1] > SOME else None

    def phrase(words: str) -> str:
        return f"{words} {name}" if plural else article(f"{words} {name}")

    captions = []
    if share > MOST:
        captions += [phrase(first), f"{name if plural else article(name)}, {first}"]
    if second is not None and share > SOME:
        captions.append(phrase(f"{first} and {second}"))
        captions.append(f"{name if plural else article(name)}, {first}, {second}")
    return captions
