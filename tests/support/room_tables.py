"""Evaluations in rooms and studies of a laser, driven in this process, for tests."""

from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.lidar_study import tabulate_study
from andabata.evaluation.rooms import RoomComparison, tabulate


def evaluated_rooms(config, policies):
    """Return the table of all cells."""
    comparison = RoomComparison.of(config, policies)
    return tabulate(comparison, policies, run_comparison(comparison))


def studied_lidar(config, policies):
    """Return the study of a laser: each change beside the laser as it is."""
    return tabulate_study(config, run_comparison(RoomComparison.of(config.cells, policies)))
