"""The installed distribution: a clone of the project, or a wheel, and what installs the rest.

Every message that advises to install something takes its line from here, since Makefile and extras
in the present folder exist in a clone alone.
"""

import shlex
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
"""Folder of the packages: the root of a clone, or ``site-packages``."""

ROS_PACKAGES = ("ros-core", "python3-rospy", "python3-rosbag")
"""Debian packages that a live graph needs."""


def is_clone(home: Path = HOME) -> bool:
    """Return True if the packages stand in a clone of the project, False if a wheel brought them.

    Args:
        home: Folder of the packages.
    """
    return (home / "pyproject.toml").is_file() and (home / "Makefile").is_file()


def install_extra(name: str) -> str:
    """Return the command that installs an extra of this project."""
    target = f".[{name}]" if is_clone() else f"andabata[{name}]"
    return f"pip install {'-e ' if is_clone() else ''}{shlex.quote(target)}"


def install_ros() -> str:
    """Return the command that installs ROS 1, where the system has it."""
    return "make ros" if is_clone() else f"apt install {' '.join(ROS_PACKAGES)} (Debian, Ubuntu)"


def install_browser() -> str:
    """Return the command that installs Chromium."""
    return "make browser" if is_clone() else "apt install chromium (Debian)"


def install_again() -> str:
    """Return the command that installs the packages anew, without what they need."""
    if is_clone():
        return f"pip install --force-reinstall --no-deps -e {shlex.quote(str(HOME))}"
    return "pip install --force-reinstall --no-deps andabata-*.whl"
