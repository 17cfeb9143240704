"""State of an installation: versions, optional packages, origins of the packages."""

import platform
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import Any

from andabata.app.doctor.import_guard import (
    changed_files,
    changed_text,
    check_origins,
    other_claims,
)
from andabata.distribution import install_browser, install_extra, install_ros
from andabata.machine.plants import bullet_step, default_plant, has_bullet, is_published
from andabata.ros.ros1_graph import DEBIAN
from andabata.runs.folder import commit

MODULES = (
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
"""Packages that every installation needs, but for pybullet, which newer Pythons have none of."""

EXTRAS = {
    "laspy": "extra las",
    "rasterio": "extra gis",
    "onnx": "extra onnx",
    "viser": "extra viewer",
    "tensorboardX": "extra tensorboard",
    "imageio_ffmpeg": "extra mp4",
    "rerun": "extra rerun",
    "ray": "extra ray",
    "mujoco": "extra mujoco",
    "zensical": "extra docs",
    "CSF": "extra peers",
    "pypatchworkpp": "extra peers",
    "cyclonedds": "extra ros2",
    "rospy": "ROS 1",
    "chromium": "a browser",
}
"""Packages and programs that only some commands and tests need, and the way to install each."""

_PROGRAMS = ("chromium",)
"""Those among them that are no Python packages."""

SYSTEM = (
    "apt-get install -y libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0 libgomp1 (Debian)"
)
"""Command that installs the system libraries."""

_RECEIVE_BUFFER = Path("/proc/sys/net/core/rmem_max")

_UDP_BUFFER = 8_388_608
"""Receive buffer that drivers of large 3D lasers ask for [bytes]: a tenth of a second of packets.

Assumption: 128 rings of 1024 columns at 20 Hz are 30 to 60 MB/s."""

_IMPORTED_BY = {"pybullet": "worlds.quiet_pybullet"}
"""Module that imports a package for us, where it is not imported by its own name."""


def check_installation() -> dict[str, Any]:
    """Return versions, optional packages and origins, ready for JSON; ``ok`` if all is there.

    Raises:
        PackageOriginError: If a sibling package is another distribution's.
    """
    state: dict[str, Any] = {"python": platform.python_version(), "commit": commit()}
    state["origins"] = check_origins()
    state["modules"] = {name: version(name) for name in MODULES}
    if not has_bullet() and not is_published():
        state["modules"]["pybullet"] = f"not installed, optional ({bullet_step()})"
    state["plant"] = default_plant()
    state["extras"] = {name: _is_installed(name) for name in EXTRAS}
    claims, changed = other_claims(), changed_files()
    state["claims"] = [claim.as_dict() | {"text": claim.text} for claim in claims]
    state["changed_files"] = [str(file) for file in changed]
    state["changed_text"] = changed_text(changed, claims)
    state["receive_buffer_bytes"] = receive_buffer()
    is_broken = any(text.startswith("broken") for text in state["modules"].values())
    is_mixed = any(claim.is_mixed for claim in claims)
    state["ok"] = not (is_broken or is_mixed or changed)
    return state


def version(name: str) -> str:
    """Return a module's version, or the reason why it cannot be imported."""
    try:
        import_module(_IMPORTED_BY.get(name, name))
    except Exception as error:  # A broken binary raises anything.
        return f"broken: {error}"
    return str(getattr(sys.modules[name], "__version__", "here"))


def _is_installed(name: str) -> bool:
    """Return True if an optional package is installed; ROS's may lie where Debian puts it."""
    if name in _PROGRAMS:
        return which(name) is not None
    return find_spec(name) is not None or (name == "rospy" and (DEBIAN / name).is_dir())


def _missing(way: str) -> str:
    """Return how to install an optional package, as the line to type."""
    kind, _, name = way.partition(" ")
    commands = {"ROS 1": install_ros, "a browser": install_browser}
    line = install_extra(name) if kind == "extra" else commands[way]()
    return f"not installed, optional ({line})"


def receive_buffer(file: Path = _RECEIVE_BUFFER) -> int | None:
    """Return the largest receive buffer of a socket [bytes]; None on systems other than Linux.

    Args:
        file: File in which Linux keeps it.
    """
    try:
        return int(file.read_text())
    except (OSError, ValueError):
        return None


def _sockets(size: int) -> str:
    """Return what the size of receive buffers means here, in one line."""
    text = (
        f"socket receive buffers: up to {size:,} bytes (net.core.rmem_max). Live view and ROS 1 "
        "need none: they use TCP, which loses nothing"
    )
    if size >= _UDP_BUFFER:
        return text
    return (
        f"{text}; a driver of a 3D laser on this machine and large clouds of ROS 2, which come by "
        "UDP, can lose packets: "
        f"`sudo sysctl -w net.core.rmem_max={_UDP_BUFFER}`"
    )


def installation_text(state: dict[str, Any]) -> str:
    """Return the state of an installation as text, one package a line."""
    lines = [f"python {state['python']}, andabata at commit {state['commit']}"]
    lines += [f"{name:12} {text}" for name, text in state["modules"].items()]
    for name, way in EXTRAS.items():
        installed = state["extras"][name]
        lines.append(f"{name:12} {'here' if installed else _missing(way)}")
    lines.append(f"plant of a robot without another one: {state['plant']}")
    home = Path(state["origins"]["andabata"]).parent
    lines.append(f"packages lie beside each other in {home}")
    lines += [claim["text"] for claim in state["claims"]]
    if state["changed_text"] is not None:
        lines.append(state["changed_text"])
    if state["receive_buffer_bytes"] is not None:
        lines.append(_sockets(state["receive_buffer_bytes"]))
    if any(text.startswith("broken") for text in state["modules"].values()):
        lines.append(f"a system library may be missing: {SYSTEM}")
    return "\n".join(lines)
