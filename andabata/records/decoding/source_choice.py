"""Source of a message: the node, frame and joints by which a user chooses one of several.

Two receivers, two IMUs or two drivers of the wheels may publish on one topic. Their messages differ
in the frame of their headers, in the publishing node where that is recorded, or in the joints that
joint states name.
"""

from collections.abc import Mapping
from typing import NamedTuple

from andabata.records.topics import RosMessage


class ReadingSource(NamedTuple):
    """Source of a message.

    Attributes:
        frame: Frame of its header, without slashes in front; empty without one.
        node: Name of the publishing node; empty if it is unknown.
        joints: Names of its joints, separated by commas; empty in other types than joint states.
    """

    frame: str = ""
    node: str = ""
    joints: str = ""

    @classmethod
    def of(cls, content: RosMessage, node: str = "") -> "ReadingSource":
        """Return the source of a message.

        Args:
            content: The message.
            node: Name of the publishing node; empty if it is unknown.
        """
        frame = str(getattr(getattr(content, "header", None), "frame_id", "")).lstrip("/")
        names = getattr(content, "name", ())
        return cls(frame, node, ",".join(names) if isinstance(names, list | tuple) else "")

    def is_called(self, name: str) -> bool:
        """Return whether a name is that of the frame, of the node or of all joints."""
        return bool(name) and (name in self or name.lstrip("/") == self.frame)

    def name_beside(self, other: "ReadingSource") -> str:
        """Return the name that distinguishes this source from another, empty without one."""
        parts = zip(self, other, strict=True)
        return next((mine for mine, theirs in parts if mine and mine != theirs), "")

    def __str__(self) -> str:
        """Return node and frame, or the joints, in words."""
        if self.node and self.frame:
            return f"{self.node} in frame {self.frame}"
        if self.node:
            return self.node
        return f"frame {self.frame}" if self.frame or not self.joints else f"joints {self.joints}"


def is_chosen(topic: str, content: RosMessage, node: str, chosen: Mapping[str, str]) -> bool:
    """Return whether a message is read.

    Args:
        topic: Name of its topic.
        content: The message.
        node: Name of the publishing node; empty if it is unknown.
        chosen: Frame, node or joints of the only source that is read, by topic.
    """
    return topic not in chosen or ReadingSource.of(content, node).is_called(chosen[topic])
