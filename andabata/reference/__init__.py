"""Reference pages of the documents, made from the code: settings and commands.

``python -m andabata.reference`` writes them; a test compares them with the committed ones.
``settings.py`` walks the configuration models, ``commands.py`` the command line.
"""

from pathlib import Path

from andabata.reference.commands import commands_page
from andabata.reference.settings import settings_page

FOLDER = Path("docs/reference")
"""Folder of the pages, from the root of the project."""


def pages() -> dict[str, str]:
    """Return the Markdown of each generated page by its file's name."""
    return {"settings.md": settings_page(), "commands.md": commands_page()}
