"""Worlds of DynaBARN, written by the tests that read them, with the faults of the public files."""

from pathlib import Path

from tests.support.sdf_worlds import PLANE, document, solid

BALL = "<cylinder><radius>0.5</radius><length> 1 </length></cylinder>"
LEFT = ((0.0, -10.0, 2.0), (4.0, -6.0, 2.0), (10.0, 2.0, 2.0))
"""Times and places of a motion: 1 m/s, then 4/3 m/s."""

_STRAY = "\\"
"""Backslash that stands in the public files after one element."""

_WALLS = (("back", "-10 0", ".5 20"), ("top", "0 10", "20 .5"), ("bottom", "0 -10", "20 .5"))


def source_text(frames=LEFT, length=None, repeats="true"):
    """Return the source of a plugin with key frames at times and places."""
    length = frames[-1][0] if length is None else length
    lines = [f'new gazebo::common::PoseAnimation("obs", {length:.2f}, {repeats}));']
    for time, x, y in frames:
        lines.append(f"key = anim->CreateKeyFrame({time:.2f});")
        lines.append(f"key->Translation(ignition::math::Vector3d({x:.2f}, {y:.2f}, 0));")
        lines.append("key->Rotation(ignition::math::Quaterniond(0, 0, 0));")
    return "\n".join(lines)


def moving_text(libraries=("libobs_0.so",), shape=BALL):
    """Return a world of three walls, whose poses are as the public files have them."""
    movers = [
        f"<model name='m{k}'>\n<static>1</static>\n<pose frame=''>-0.2 0.1 0 0 0 0</pose>"
        f"<link name='l'><collision name='c'><geometry>{shape}</geometry></collision></link>"
        f"<plugin name='m{k}' filename='{library}'/></model>"
        for k, library in enumerate(libraries)
    ]
    walls = [
        f'<model name="{name}"><static>1</static>{_STRAY * (name == "back")}'
        f"<pose frame=>{place} .5 0 0 0</pose><link name='l'><collision name='c'><geometry><box>"
        f"<size>{size} 1</size></box></geometry></collision></link></model>"
        for name, place, size in _WALLS
    ]
    return document(solid("ground", PLANE), *movers, *walls, version="1.6")


def write_moving_world(folder: Path, number: int = 0, motions=(LEFT,)) -> Path:
    """Write a world and the sources of its plugins, and return the folder."""
    (folder / "plugins").mkdir(parents=True, exist_ok=True)
    libraries = [f"libobs_{k}.so" for k in range(len(motions))]
    (folder / f"world_{number}.world").write_text(moving_text(libraries), encoding="utf-8")
    for k, motion in enumerate(motions):
        path = folder / "plugins" / f"obs_{k}.cc"
        path.write_text(source_text(motion), encoding="utf-8")
    return folder
