"""Pictures as PNG bytes: drives, perception, training and benchmarks."""
