"""Controllers and classifiers judged: trials, scenarios, failure causes, statistics."""
