"""Evaluation of controllers and classifiers: trials, scenarios, failure causes, statistics."""
