"""Live view in a browser: drives, recordings and evaluations in rooms, served on this machine.

``server`` is the page and its life, ``drive_view`` the view of a drive, ``offroad_scene`` what is
drawn there, ``controls`` what can be pressed; ``recorded`` and ``room_view`` play what was kept.
"""
