"""Coordinate frames of recordings, and the poses of sensors in them.

``extrinsics.py`` comes first: it takes the pose of each sensor from an option, ``/tf`` or a frame's
name, and checks it against what the sensors measure.
"""
