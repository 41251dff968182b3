"""Which times a simulation steps to."""
