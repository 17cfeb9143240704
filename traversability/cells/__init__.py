"""Features of one polar cell from its points, compiled; ``shape.py`` puts them together."""
