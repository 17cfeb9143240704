"""Localization: sensor readings in, pose and covariance out."""
