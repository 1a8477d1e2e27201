"""Compiled code: functions of floats and flat arrays, each the same as plain Python and as machine code."""
