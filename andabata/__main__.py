"""``python -m andabata``."""

from andabata.app.cli import run

run()
