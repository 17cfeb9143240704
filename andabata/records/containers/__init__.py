"""Formats of recordings, read without their types; ``opening.open_container`` comes first."""
