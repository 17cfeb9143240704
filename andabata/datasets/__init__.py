"""Labelled clouds: how they are made, their hazards, and other layouts on disk."""
