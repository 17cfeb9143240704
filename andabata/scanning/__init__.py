"""Scans of any cloud: mounting, levelling, cells and virtual scan, and a diagnosis of mistakes."""
