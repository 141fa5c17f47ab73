"""Figures and tables from files on disk; nothing is solved.

It may import: scene, results.
"""
