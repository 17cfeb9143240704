"""Recordings through the same navigator that drives. Read ``replay.py`` first."""
