"""Figures and tables from the files of a run: nothing here solves, and no number depends on it."""
