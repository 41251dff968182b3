"""When a long computation saves: now and then, and as it is interrupted."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from jaxphys.core.interrupt import deferred_interrupt

SAVE_EVERY = 20.0  # seconds of work that an interruption without warning may cost

AfterStep = Callable[[Callable[[], None], Callable[[], None] | None], None]


@contextmanager
def saving() -> Iterator[AfterStep]:
    """Yields `after(save, watch)`, to be called after each step.

    It calls `watch`, if there is one, which may raise KeyboardInterrupt; then `save`, if that did,
    if Ctrl-C came, or if the last time is long ago; and raises KeyboardInterrupt where it must end.
    """
    saved = time.monotonic()
    with deferred_interrupt() as interrupted:

        def after(save: Callable[[], None], watch: Callable[[], None] | None = None) -> None:
            nonlocal saved
            stop = interrupted()
            try:
                if watch is not None:
                    watch()
            except KeyboardInterrupt:
                stop = True
            if stop or time.monotonic() - saved > SAVE_EVERY:
                save()
                saved = time.monotonic()
            if stop:
                raise KeyboardInterrupt

        yield after
