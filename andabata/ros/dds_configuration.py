"""Configuration of DDS by the environment variables of ROS 2 and of Cyclone DDS."""

from collections.abc import Mapping
from xml.etree.ElementTree import ParseError

from defusedxml.ElementTree import fromstring

from andabata.ros.graph import RosError

_LARGEST_DOMAIN = 232
"""Largest domain whose ports exist."""

_FAST_DDS = "1.15"
"""Vendor number of Fast DDS, in decimal."""

_COMPATIBILITY = (
    "<CycloneDDS><Domain><Compatibility>"
    # Without it nothing passes between the two: each describes the same type in another way.
    f"<IgnoreTypeInformation>{_FAST_DDS}</IgnoreTypeInformation>"
    "</Compatibility></Domain></CycloneDDS>"
)

_LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces>"
    '<NetworkInterface address="127.0.0.1" multicast="true"/>'
    "</Interfaces></General></Domain></CycloneDDS>"
)

# Announced each second: a peer that comes later is reached by no multicast.
_UNICAST = (
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><SPDPInterval>1s</SPDPInterval>"
    "<Peers>{peers}</Peers></Discovery></Domain></CycloneDDS>"
)

_OLD_DISTRIBUTIONS = ("dashing", "eloquent", "foxy", "galactic", "humble")
"""Distributions of ROS 2 before Iron."""

_RANGES = ("SUBNET", "LOCALHOST", "OFF", "SYSTEM_DEFAULT")


def domain_id(environment: Mapping[str, str]) -> int:
    """Return the number of the domain, ``ROS_DOMAIN_ID``, by default 0.

    Args:
        environment: Environment variables.

    Raises:
        RosError: If it is not a number from 0 to 232.
    """
    text = environment.get("ROS_DOMAIN_ID") or "0"
    if not text.isdecimal() or int(text) > _LARGEST_DOMAIN:
        raise RosError(
            f"ROS_DOMAIN_ID: expected a number from 0 to {_LARGEST_DOMAIN}, got {text!r}; set the "
            "one that the other nodes have"
        )
    return int(text)


def configuration(environment: Mapping[str, str]) -> str:
    """Return the configuration of Cyclone DDS: ours, and over it the user's ``CYCLONEDDS_URI``.

    Args:
        environment: Environment variables.

    Raises:
        RosError: If ``ROS_AUTOMATIC_DISCOVERY_RANGE`` is none of ROS 2's, or the user's
            configuration is text that is no XML, of which Cyclone DDS would take a part.
    """
    parts = [_COMPATIBILITY, *_discovery(environment)]
    user = environment.get("CYCLONEDDS_URI", "").strip()
    if user.startswith("<"):
        try:
            fromstring(f"<all>{user}</all>")
        except ParseError as error:
            raise RosError(
                f"CYCLONEDDS_URI={user}: expected XML, got {error}; mend it or unset CYCLONEDDS_URI"
            ) from error
    return ",".join([*parts, user] if user else parts)


def _discovery(environment: Mapping[str, str]) -> list[str]:
    """Return what the range of discovery asks for.

    Raises:
        RosError: If it is none of ROS 2's.
    """
    if environment.get("ROS_LOCALHOST_ONLY") == "1":  # It takes precedence, as in ROS 2.
        return [_LOOPBACK]
    scope = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "SUBNET"
    if scope not in _RANGES:
        raise RosError(
            f"ROS_AUTOMATIC_DISCOVERY_RANGE: expected one of {', '.join(_RANGES)}, got {scope!r}"
        )
    peers = [each for each in environment.get("ROS_STATIC_PEERS", "").split(";") if each]
    if scope in ("SUBNET", "SYSTEM_DEFAULT") and not peers:
        return []
    if scope == "LOCALHOST":
        peers = ["localhost", *peers]
    listed = "".join(f'<Peer address="{peer}"/>' for peer in peers)
    if scope in ("LOCALHOST", "OFF"):
        return [_UNICAST.format(peers=listed)]
    return [
        f"<CycloneDDS><Domain><Discovery><Peers>{listed}</Peers></Discovery></Domain></CycloneDDS>"
    ]


def gid_size(environment: Mapping[str, str]) -> int:
    """Return the size of the identifiers in which nodes are announced [bytes].

    Iron cut it from 24 to 16: nodes of Humble and of later distributions do not see each other's
    names. ``ROS_DISTRO`` chooses.

    Args:
        environment: Environment variables.
    """
    return 24 if environment.get("ROS_DISTRO", "") in _OLD_DISTRIBUTIONS else 16
