"""Benchmarks: speed and accuracy of this project and of its peers, and where the numbers come from.

``andabata bench`` runs ``speed``, ``perception``, ``localization``, ``vehicle`` and ``chain``.
Modules that do not serve it run as ``python -m andabata.bench.NAME``, single measurements as
``python -m andabata.bench.studies.NAME``; ``--help`` shows their options.
"""
