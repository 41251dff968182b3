"""Suite 'extreme-peers': peers in the catalogue's scenes (`benchmarks.extreme.peers`)."""

from benchmarks.extreme.peers import lines

__all__ = ["lines"]
