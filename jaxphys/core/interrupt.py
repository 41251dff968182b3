"""Ctrl-C where it does no harm: between frames, and not in the middle of a file."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def deferred_interrupt() -> Iterator[Callable[[], bool]]:
    """Yields a function that tells whether an interrupt has come in.

    The first Ctrl-C only sets the answer, so that work reaches a point from which it can be
    resumed; the second one interrupts at once, and any that follow are ignored until the block is
    left, so that what is half done can be taken away. Outside the main thread, where signals
    cannot be taken, nothing changes.
    """
    asked = 0
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.getsignal(signal.SIGINT)

    def note(number, frame):
        nonlocal asked
        asked += 1
        if asked == 2:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: asked > 0
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def held_interrupt() -> Iterator[None]:
    """Ctrl-C inside counts only at the end of the block: for what is short, and must be whole.

    Outside the main thread nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before, came = signal.getsignal(signal.SIGINT), []
    signal.signal(signal.SIGINT, lambda number, frame: came.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if callable(before):
            for arguments in came:
                before(*arguments)
