"""Figures: drives, perception, training and benchmarks, as PNG, SVG and parts of pages."""
