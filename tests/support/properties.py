"""Laws for drawn examples: the same in every run, and few enough for every run of the tests."""

from hypothesis import HealthCheck, settings

law = settings(
    derandomize=True,
    database=None,
    deadline=None,
    max_examples=25,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
"""Decorator of a law."""
