"""Cells settling on micropillars: large deformations, frictionless contact, and how accurate each number is."""

__version__ = "0.1.0"
