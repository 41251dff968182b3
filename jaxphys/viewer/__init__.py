"""A window in the browser on a simulation that runs: looked at, poked, pulled, changed, saved.

`session` is the simulation that takes commands, and knows no browser; `window` is the browser, and
knows no physics; `serve` runs the first in one thread and shows it in the second.
"""
