"""Soak: what is promised of reliability, each promise checked over many trials.

``python -m andabata.bench.studies.soak`` runs all checks in full, some hours, and ends with a
table; ``--minutes 10`` runs as many trials as fit into ten minutes on two cores. ``promises`` lists
the promises, ``runner`` runs each in a process of its own.
"""
