"""Twenty prompts, refined by the rules and by SmolLM2, as docs/refiners.md shows them.

    JAXPHYS_LLM_PATH=.../SmolLM2-135M-Instruct.Q4_1.gguf python -m experiments.refiners
    python -m experiments.refiners --speed      # prints how long it takes and how much memory

The prompts were written before any of the outputs was seen, and the model's instruction was tuned
on others. Two checks (answers in circles, answers copied from the examples) and the words of
posture among the surroundings came after a first look at the outputs.
"""

import argparse
import itertools
import os
import resource
import statistics
import sys
import time
from pathlib import Path

from jaxphys.core.errors import InputError
from jaxphys.guidance.prompts.language_model import LanguageModel, Message
from jaxphys.guidance.prompts.local import PATH, find_local
from jaxphys.guidance.prompts.refine import Refinement, refined_by

DOCUMENT = Path(__file__).parents[1] / "docs" / "refiners.md"
MARK = "<!-- From here on written by python -m experiments.refiners -->\n"

VAGUE = (
    "a red rose",
    "a chair",
    "a small dragon",
    "an old book",
    "a cute owl",
    "a treasure chest",
    "a teapot",
    "a lighthouse",
    "something to sit on",
    "a mushroom",
)
LONG = (
    "I want a birthday cake with three layers, the lowest one chocolate and the two above it "
    "vanilla, strawberries on top and one single candle which is blue, and it should look as if "
    "my grandmother had made it for me when I was a child",
    "a knight's helmet that has seen a hundred battles, dented steel with a scratch across the "
    "visor and a torn red plume, lying in the mud of a battlefield while crows circle in the "
    "sky",
    "imagine a rubber duck, but it is also a pirate, with a black eye patch, a tiny tricorn hat "
    "and a wooden leg even though ducks in bathtubs hardly need legs, floating between soap "
    "bubbles",
    "there is an antique globe on a brass stand, the continents are drawn in faded brown ink "
    "and sea monsters are painted in the oceans, it belonged to an explorer who never came home",
    "a wooden rocking horse with a mane of white wool and a saddle painted in blue and gold, "
    "one of its ears is missing because the dog bit it off, it stands in the attic beside boxes "
    "of letters",
    "please create a coffee machine from the future that does not look like a coffee machine "
    "but rather like a small silver rocket with three round windows, red fins and a spout, on a "
    "kitchen counter in the morning light",
    "a cactus in a terracotta pot, the kind of cactus with two arms like in a western film, "
    "with long white spines and one pink flower that only opens at night when nobody is "
    "watching it",
    "the violin of a travelling musician, its varnish is honey-coloured and worn off where the "
    "chin rests, one of the four strings is broken, and a ribbon is tied around the scroll, "
    "leaning against a caravan beside a camp fire",
    "a snow globe in which a tiny village with a church and snowy roofs can be seen, with a "
    "dark green wooden base and a silver plate on it, that somebody has forgotten on a train",
    "a stack of pancakes so high that it leans to one side, with melting butter, maple syrup "
    "running down and blueberries that are about to fall off, served to a bear who waits at a "
    "table",
)


def cell(text: str) -> str:
    return text.replace("|", "\\|")


def table(prompts: tuple[str, ...], found: dict[str, tuple[Refinement, Refinement]]) -> str:
    """One prompt a row; below a model's answer, what was asked in vain before it."""
    rows = ["| prompt | rules | SmolLM2 |", "|---|---|---|"]
    for prompt in prompts:
        rules, local = found[prompt]
        answer = local.refined if local.answer else "*(the rules)*"
        vain = "".join(
            f"<br>*refused: {attempt.answer!r}, {attempt.problem.removeprefix('the answer ')}*"
            for attempt in local.attempts
        )
        rows.append(f"| {cell(prompt)} | {cell(rules.refined)} | {cell(answer + vain)} |")
    return "\n".join(rows) + "\n"


def summary(name: str, answers: list[Refinement]) -> str:
    first = sum(bool(answer.answer) and not answer.attempts for answer in answers)
    later = sum(bool(answer.answer and answer.attempts) for answer in answers)
    refused = [attempt for answer in answers for attempt in answer.attempts]
    asked = len(refused) + first + later
    return (
        f"{name}: of {len(answers)} prompts {first} were answered at once, {later} when asked"
        f" again, {len(answers) - first - later} by the rules in the end; of {asked} answers"
        f" {len(refused)} were refused.\n"
    )


def write(local) -> None:
    found = {}
    for prompt in VAGUE + LONG:
        found[prompt] = (refined_by([], prompt), refined_by([local], prompt))
        print(f"{prompt[:40]}: {found[prompt][1].refined}", flush=True)
    parts = []
    for name, prompts in (("Vague", VAGUE), ("Long", LONG)):
        answers = [found[prompt][1] for prompt in prompts]
        parts += [f"## {name} prompts\n", summary(name, answers), table(prompts, found)]
    before, _, _ = DOCUMENT.read_text().partition(MARK)
    DOCUMENT.write_text(before + MARK + "\n" + "\n".join(parts))


def speed(path: str) -> None:
    """Prints the times of loading, of reading 512 tokens and of writing, and the memory."""
    started = time.perf_counter()
    model = LanguageModel.load(path)
    print(f"load: {time.perf_counter() - started:.1f} s")
    asked = [Message("user", "Tell me a long story about a lighthouse. " * 50)]
    moments = []

    def note(text: str) -> bool:
        moments.append(time.perf_counter())
        return False

    for run in ("compiling", "first", "second", "third"):
        moments.clear()
        started = time.perf_counter()
        # Another text every time: the last one is remembered.
        answer = model.answer([Message("system", run), *asked], max_tokens=64, until=note)
        steps = [after - before for before, after in itertools.pairwise(moments)]
        print(
            f"{run}: reading {len(model.conversation(asked))} tokens {moments[0] - started:.2f} s,"
            f" writing {len(moments)}: median {1 / statistics.median(steps):.1f} tokens/s,"
            f" fastest {1 / min(steps):.1f}, {len(answer)} characters"
        )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    print(f"peak memory of the process: {peak:.2f} GiB; load of the computer: {load}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--speed", action="store_true", help="only measure")
    asked = parser.parse_args()
    local = find_local(os.environ)
    if local is None:
        raise InputError(f"{PATH}: is not set; name SmolLM2's file")
    if asked.speed:
        speed(os.environ[PATH])
    else:
        write(local)
    return 0


if __name__ == "__main__":
    sys.exit(main())
