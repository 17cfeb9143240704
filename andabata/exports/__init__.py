"""Recordings as files of other tools: rerun, Foxglove, GeoJSON, CSV, tracks and clouds."""
