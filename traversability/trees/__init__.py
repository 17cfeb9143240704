"""Decision trees: flat arrays that compiled loops walk, in bins, and their fitting."""
