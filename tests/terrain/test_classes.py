"""Semantic classes: each has properties, and they are consistent."""

import numpy as np

from terrain.classes import TRAITS, SemanticClass


def test_every_class_has_traits():
    """The table covers exactly the classes."""
    assert set(TRAITS) == set(SemanticClass)


def test_stored_values_never_change():
    """Clouds on disk hold these numbers."""
    assert [kind.name for kind in sorted(SemanticClass)] == [
        *("GROUND", "PATH", "TRUNK", "FOLIAGE", "BUSH", "ROCK", "HIGH_GRASS", "WALL", "POST"),
        *("LAMP", "BENCH", "TABLE", "BIN", "CABLE", "STONE", "WATER", "WALKER"),
        *("STALKS", "MEADOW", "THICKET", "SHORT_GRASS", "KERB", "ROOT"),
    ]
    assert sorted(SemanticClass) == list(range(23))


def test_beams_pass_exactly_what_wheels_pass():
    """A class without a body is porous and not traversable; a class with a body is opaque."""
    for traits in TRAITS.values():
        assert traits.solid == np.isinf(traits.hits_per_metre)
        assert traits.solid or not traits.traversable


def test_what_may_be_driven_on():
    """Ground, paths, stones, low roots and short grass are traversable, nothing else is."""
    free = {kind for kind, traits in TRAITS.items() if traits.traversable}
    assert free == {
        SemanticClass.GROUND,
        SemanticClass.PATH,
        SemanticClass.STONE,
        SemanticClass.SHORT_GRASS,
        SemanticClass.ROOT,
    }


def test_only_water_swallows_beams():
    """One beam in twenty returns from water, every one from the rest."""
    lossy = {kind: traits.returns for kind, traits in TRAITS.items() if traits.returns != 1.0}
    assert lossy == {SemanticClass.WATER: 0.05}


def test_plants_are_judged_by_their_height():
    """Grass and stands are, bushes and all solid things are not."""
    judged = {kind for kind, traits in TRAITS.items() if traits.by_height}
    stands = {SemanticClass.STALKS, SemanticClass.MEADOW, SemanticClass.THICKET}
    assert judged == stands | {SemanticClass.HIGH_GRASS}
    # From the thinnest to the densest: 0.1 to 0.6 of the beams stopped in half a metre.
    stopped = [1 - np.exp(-0.5 * TRAITS[kind].hits_per_metre) for kind in sorted(stands)]
    assert stopped == sorted(stopped)
    assert 0.1 < stopped[0] < stopped[-1] < 0.6
