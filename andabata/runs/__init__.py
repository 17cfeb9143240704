"""Runs on disk: whole files or none, journals, locks, and descriptions of how runs were made."""
