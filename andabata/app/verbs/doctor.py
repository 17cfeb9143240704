"""``andabata doctor``: is everything here that the others need?"""

import platform
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import typer

from andabata.app.options import Json

_MODULES = (
    "numpy",
    "numba",
    "torch",
    "sklearn",
    "pybullet",
    "open3d",
    "gymnasium",
    "rosbags",
    "mcap",
)
_EXTRAS = {
    "laspy": "extra las",
    "onnx": "extra onnx",
    "CSF": "extra peers",
    "pypatchworkpp": "extra peers",
    "rospy": "make ros",
}
"""What is only needed for some things, and how to get it."""

_SYSTEM = (
    "apt-get install -y libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0 libgomp1 (Debian)"
)


def doctor(as_json: Json = False) -> None:
    """Check the installation: versions, system libraries, package origins."""
    from andabata.app.console import Console
    from andabata.app.import_guard import check_origins
    from andabata.records.runs import commit

    found: dict[str, Any] = {"python": platform.python_version(), "commit": commit()}
    found["origins"] = check_origins()
    found["modules"] = {name: _version(name) for name in _MODULES}
    found["extras"] = {name: _is_there(name) for name in _EXTRAS}
    broken = {name: text for name, text in found["modules"].items() if text.startswith("broken")}
    found["ok"] = not broken
    lines = [f"python {found['python']}, andabata at commit {found['commit']}"]
    lines += [f"{name:12} {text}" for name, text in found["modules"].items()]
    for name, how in _EXTRAS.items():
        there = found["extras"][name]
        lines.append(f"{name:12} {'here' if there else f'not installed, and optional ({how})'}")
    lines.append(f"packages lie beside each other in {found['origins']['andabata']}")
    if broken:
        lines.append(f"a system library may be missing: {_SYSTEM}")
    Console(as_json=as_json).result(found, "\n".join(lines))
    if broken:
        raise typer.Exit(1)


def _is_there(name: str) -> bool:
    """Return whether an optional package is installed; ROS's may lie where Debian puts it."""
    from andabata.ros.graph import DEBIAN

    return find_spec(name) is not None or (name == "rospy" and (DEBIAN / name).is_dir())


def _version(name: str) -> str:
    """Return a module's version, or why it cannot be imported."""
    try:
        module = import_module(name)
    except Exception as error:  # Whatever a broken binary raises.
        return f"broken: {error}"
    return str(getattr(module, "__version__", "here"))
