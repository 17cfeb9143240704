"""Warnings of an import: what was left out and what was read otherwise than it is written."""

from collections.abc import Mapping

from worlds.sdf.elements import Element

_READ: Mapping[str, frozenset[str]] = {
    "world": frozenset(
        (
            *("atmosphere", "audio", "frame", "gravity", "gui", "include", "magnetic_field"),
            *("model", "physics", "scene", "spherical_coordinates", "state", "wind"),
        )
    ),
    "model": frozenset(
        (
            *("allow_auto_disable", "enable_wind", "frame", "include", "link", "model", "pose"),
            *("self_collide", "static"),
        )
    ),
    "link": frozenset(
        (
            *("collision", "enable_wind", "gravity", "inertial", "kinematic"),
            *("must_be_base_link", "pose", "self_collide", "velocity_decay", "visual"),
        )
    ),
    "collision": frozenset(("geometry", "laser_retro", "max_contacts", "pose", "surface")),
}
"""Elements that are read or have no part in where shapes are, by what they are in."""

_LEFT_OUT = frozenset(
    (
        *("actor", "audio_sink", "audio_source", "battery", "gripper", "joint", "light"),
        *("particle_emitter", "plugin", "population", "projector", "road", "sensor"),
    )
)
"""Elements of SDF that are left out with a warning."""


class Notes:
    """Warnings, those of one kind together: how many there were, and where the first one is."""

    def __init__(self) -> None:
        """Begin without any."""
        self._found: dict[str, tuple[int, str]] = {}

    def add(self, text: str, element: Element) -> None:
        """Take a warning.

        Args:
            text: Warning, equal for equal kinds.
            element: Element that it is about.
        """
        count, first = self._found.get(text, (0, element.where))
        self._found[text] = (count + 1, first)

    def check(self, element: Element, parent: str) -> None:
        """Take a warning if an element is left out.

        Args:
            element: Element.
            parent: Kind of the element that it is in.
        """
        if element.tag in _LEFT_OUT:
            self.add(f"{element.tag} left out", element)
        elif element.tag not in _READ.get(parent, ()):
            self.add(f"unknown element <{element.tag}> left out", element)

    @property
    def lines(self) -> tuple[str, ...]:
        """Warnings in the order in which they first came, one a line."""
        return tuple(
            f"{first}: {text}" + (f" ({count} of them)" if count > 1 else "")
            for text, (count, first) in self._found.items()
        )
