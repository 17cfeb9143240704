"""Options of commands: single ones and groups that are parsed once; begin with ``shared.py``."""
