"""What fits find of numbers that are known: one file an experiment, one line a case."""
