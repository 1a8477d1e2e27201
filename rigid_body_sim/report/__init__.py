"""Measurements: what a step costs."""
