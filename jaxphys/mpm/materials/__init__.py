"""Constitutive laws, one idea a file, and the materials that users know them by."""
