"""Small worlds of Gazebo, written by the tests that read them."""

from pathlib import Path

import numpy as np

from worlds.sdf.world import SdfWorld, read_sdf

CUBE = "<box><size>1 1 1</size></box>"
POST = "<cylinder><radius>0.1</radius><length>1</length></cylinder>"
PLANE = "<plane><normal>0 0 1</normal><size>100 100</size></plane>"


def collision(shape: str = CUBE, inside: str = "", name: str = "c") -> str:
    """Return a collision of a shape."""
    return f'<collision name="{name}">{inside}<geometry>{shape}</geometry></collision>'


def pose(*numbers: float, **attributes: str) -> str:
    """Return a pose; missing numbers are 0."""
    given = "".join(f' {name}="{value}"' for name, value in attributes.items())
    values = " ".join(map(str, [*numbers, *[0] * (6 - len(numbers))]))
    return f"<pose{given}>{values}</pose>"


def link(*parts: str, name: str = "l") -> str:
    """Return a link of some parts."""
    return f'<link name="{name}">{"".join(parts)}</link>'


def model(name: str, *parts: str, attributes: str = "") -> str:
    """Return a static model of some parts."""
    return f'<model name="{name}" {attributes}><static>1</static>{"".join(parts)}</model>'


def solid(name: str, shape: str = CUBE, at: str = "") -> str:
    """Return a model of one shape at a pose."""
    return model(name, at, link(collision(shape)))


def document(*parts: str, version: str = "1.7", world: str = "w") -> str:
    """Return a world, each of its parts on a line of its own from the third on."""
    lines = [f'<sdf version="{version}">', f'<world name="{world}">', *parts, "</world>", "</sdf>"]
    return "\n".join(lines)


def model_document(text: str, version: str = "1.7") -> str:
    """Return a file of one model."""
    return f'<sdf version="{version}">\n{text}\n</sdf>'


def include(uri: str, *parts: str, attributes: str = "") -> str:
    """Return an include of a model."""
    return f"<include {attributes}><uri>{uri}</uri>{''.join(parts)}</include>"


def write(path: Path, text: str) -> Path:
    """Write a file and the folders around it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def read(folder: Path, *parts: str, version: str = "1.7", **options: object) -> SdfWorld:
    """Return what collides in a world of some parts."""
    return read_sdf(write(folder / "test.world", document(*parts, version=version)), **options)


def places(world: SdfWorld) -> dict[str, np.ndarray]:
    """Return the place of each shape by the name of its model [m]."""
    return {each.name.rsplit("::", 2)[0]: each.pose[:3, 3] for each in world.solids}
