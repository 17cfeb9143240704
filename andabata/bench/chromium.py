"""A headless Chromium for pages of this project: their benchmark, and their tests.

It draws without a graphics card. Debian's Chromium and playwright have to be there (``make
browser``, extra ``dev``).
"""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from andabata.distribution import install_browser

if TYPE_CHECKING:
    from playwright.sync_api import Browser

EXECUTABLE = Path("/usr/bin/chromium")
"""Where Debian puts it."""

_ARGUMENTS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)


def missing() -> str | None:
    """Return what a browser lacks here, in words; None where there is all."""
    if not EXECUTABLE.exists():
        return f"no {EXECUTABLE}: `{install_browser()}` installs it"
    if importlib.util.find_spec("playwright") is None:
        return "no playwright: it comes with the extra `dev`"
    return None


@contextmanager
def browser() -> Iterator["Browser"]:
    """Yield a headless browser with a profile of its own, and close it at the end."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=str(EXECUTABLE), args=list(_ARGUMENTS))
        try:
            yield made
        finally:
            made.close()
