"""From senses to a steering command. Read ``navigator.py`` first."""
