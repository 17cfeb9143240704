"""What a ``<state>`` says: where a saved simulation left models and links, in the world's frame."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from worlds.sdf.elements import Element
from worlds.sdf.shapes import Vector
from worlds.sdf.values import Pose, lengths, pose_of

_NO_SCALE: Vector = (1.0, 1.0, 1.0)


@dataclass
class ModelState:
    """State of one model.

    Attributes:
        pose: Pose in the world; None where its description has it.
        scale: Factors that come on top of the measures of its shapes.
        links: Pose of each link in the world.
        models: States of nested models.
        element: Element that says it; None if none does.
    """

    pose: Pose | None = None
    scale: Vector = _NO_SCALE
    links: dict[str, Pose] = field(default_factory=dict)
    models: dict[str, "ModelState"] = field(default_factory=dict)
    element: Element | None = None


def world_state(world: Element) -> dict[str, ModelState]:
    """Return the states of a world's models by name; of several states the last one counts.

    Raises:
        SdfError: If a pose or a scale is none.
    """
    states: dict[str, ModelState] = {}
    for state in world.all("state"):
        states |= _models(state.all("model"))
    return states


def inserted(world: Element) -> list[Element]:
    """Return the models that the states add to a world."""
    boxes = (box for state in world.all("state") for box in state.all("insertions"))
    return [model for box in boxes for model in box.all("model")]


def deleted(world: Element) -> set[str]:
    """Return the names of the models that the states take from a world."""
    boxes = (box for state in world.all("state") for box in state.all("deletions"))
    return {name.text.strip() for box in boxes for name in box.all("name")}


def _models(elements: Iterable[Element]) -> dict[str, ModelState]:
    """Return the states of models by name."""
    return {each.attributes.get("name", ""): _model(each) for each in elements}


def _model(element: Element) -> ModelState:
    """Return the state of a model."""
    scale = element.child("scale")
    x, y, z = _NO_SCALE if scale is None else lengths(scale, 3)
    state = ModelState(
        _pose(element), (x, y, z), models=_models(element.all("model")), element=element
    )
    for link in element.all("link"):
        pose = _pose(link)
        if pose is None:
            continue
        # Links of included models were once those of the model around, under names such as a::b.
        *outer, name = link.attributes.get("name", "").split("::")
        inner = state
        for part in outer:
            inner = inner.models.setdefault(part, ModelState())
        inner.links[name] = pose
    return state


def _pose(element: Element) -> Pose | None:
    """Return the pose that a state gives, None if it gives none."""
    pose = element.child("pose")
    return None if pose is None else pose_of(pose)
