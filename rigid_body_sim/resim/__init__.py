"""Runs simulated again: by a journal or by commands and their times, and compared with what was recorded."""
