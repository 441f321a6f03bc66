"""Fit measures, sway measures and statistical tests: arrays in, frozen dataclasses out."""
