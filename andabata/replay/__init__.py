"""Replay of recordings through the navigator that drives: ``replay.replay_bag`` comes first."""
