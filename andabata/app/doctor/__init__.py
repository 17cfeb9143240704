"""Checks of the installation: versions, origins of the packages, small known problems."""
