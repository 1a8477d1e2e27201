"""Whole runs in one call: schedules of commands that go in, trajectories that come out."""
