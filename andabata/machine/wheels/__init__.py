"""The plant of ray-cast wheels: a rigid body with the reference's forces in compiled code.

``vehicle.py`` is the plant, ``dynamics.py`` its step.
"""
