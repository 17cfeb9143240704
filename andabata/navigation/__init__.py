"""From sensor readings to a steering command. Read ``navigator.py`` first."""
