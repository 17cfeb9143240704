"""Sources of one thing: reported where there are two, refused where they differ."""

from andabata.records.sources import SourceDifference, Sources


def test_two_sources_are_shared():
    """One source is no matter, two are named with their numbers of messages."""
    sources = Sources()
    sources.add("a")
    assert not sources.is_shared
    sources.add("b")
    sources.add("b")
    assert sources.is_shared
    assert sources.names == "b (2 messages) and a (1 messages)"
    assert sources.contradiction is None


def test_a_median_beyond_the_bound_is_a_contradiction():
    """The median counts, so that one outlier decides nothing."""
    sources = Sources(enough=3)
    for share in (0.5, 40.0):
        sources.add("a", SourceDifference(share, f"{share} m"))
    assert sources.contradiction is None
    sources.add("a", SourceDifference(0.9, "0.9 m"))
    assert sources.contradiction is None
    for share in (1.5, 2.0):
        sources.add("b", SourceDifference(share, f"{share} m"))
    assert sources.contradiction == "1.5 m"
