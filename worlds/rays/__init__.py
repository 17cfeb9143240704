"""Rays against a world of terrain and objects: begin with ``scene.py``.

``layout`` holds the arrays that rays are cast against, ``walk`` goes along them block by block, and
``ground`` and ``objects`` find where a ray meets what.
"""
