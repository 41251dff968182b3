"""Prompt refinement: who is asked, what is asked, and what makes an answer usable."""
