"""Derivatives of every axis against differences."""
