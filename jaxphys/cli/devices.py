"""On how many devices a command computes: set before JAX starts, which it does at its first use."""

import os
import sys

from jaxphys.core.errors import InputError

DEVICES = "--devices"
VARIABLE = "JAX_NUM_CPU_DEVICES"


def without_devices(arguments: list[str]) -> tuple[list[str], int | None]:
    """Arguments without `--devices N` or `--devices=N`, and N, None where it is not given.

    Raises:
        InputError: N is missing, or no whole number above zero.
    """
    rest, number = [], None
    words = iter(arguments)
    for word in words:
        name, equals, value = word.partition("=")
        if name != DEVICES:
            rest.append(word)
            continue
        text = value if equals else next(words, "")
        if not text.isascii() or not text.isdigit() or int(text) < 1:
            raise InputError(f"{DEVICES}: expected a number of devices from 1 on, got {text!r}")
        number = int(text)
    return rest, number


def cores() -> int:
    """Processor cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def use_devices(number: int | None) -> None:
    """Lets a processor count as `number` devices for JAX, None: one for each core unless somebody
    has said otherwise. Accelerators are as many as there are.

    Raises:
        InputError: more than there are cores, or JAX has started.
    """
    said = VARIABLE in os.environ or "host_platform_device_count" in os.environ.get("XLA_FLAGS", "")
    if number is None:
        if not said and "jax" not in sys.modules:
            os.environ[VARIABLE] = str(cores())
        return
    if number > cores():
        raise InputError(f"{DEVICES}: {number} devices, but this process may use {cores()} cores")
    if "jax" not in sys.modules:
        os.environ[VARIABLE] = str(number)
        return
    try:
        sys.modules["jax"].config.update("jax_num_cpu_devices", number)
    except RuntimeError as error:
        raise InputError(f"{DEVICES}: JAX has started already ({error})") from None
