"""Files of recordings, read to the byte without knowing the types: ``opening.open_container``."""
