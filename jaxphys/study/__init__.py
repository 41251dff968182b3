"""Studies with people: a blinded page to hand out, and what its answers say.

No rating comes with this package. Those of its tests are simulated from a known truth, and marked
so.
"""
