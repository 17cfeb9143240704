"""Cells of a Cartesian grid around the robot: features, classifier, and a grid that rolls along."""
