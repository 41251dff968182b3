"""Pages that explain runs by themselves: one file of HTML, opened from the disk, without requests.

Knows arrays and plain facts, no scenes: `pipeline` finds these in a run's folder.
"""
