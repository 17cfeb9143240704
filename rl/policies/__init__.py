"""Policies without torch, compiled: perceptrons, networks on point sets, and how they explore."""
