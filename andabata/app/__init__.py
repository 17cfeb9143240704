"""Command line of the robot; begin with ``cli.py`` and ``verbs/drive.py``."""
