"""Measurements: the report, and what a step costs."""
