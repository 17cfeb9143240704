"""Where am I: measurements in, pose and covariance out."""
