"""Trees of frames for tests."""

from andabata.records.frames.transform_tree import TransformTree
from andabata.records.messages import NS, MessageBuilder
from tests.support.edited_bags import stamped

COMPOSE = MessageBuilder(1)
NONE = (0, 0, 0)


def tree_of(*placed, moving=()):
    """Return a tree of static transforms, and of moving ones with their stamps [s]."""
    tree = TransformTree()
    tree.add([stamped(COMPOSE, each) for each in placed], static=True)
    tree.add([stamped(COMPOSE, each, round(at * NS)) for at, each in moving], static=False)
    return tree


def place(tree, name):
    """Return the transform from a frame to its base."""
    found = tree.find(name)
    return tree.lookup(found, tree.base_of(found))
