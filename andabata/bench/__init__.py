"""Benchmarks: speed and accuracy of this project and of its peers, and where the numbers come from.

``andabata bench`` runs ``speed``, ``perception``, ``localization``, ``vehicle`` and ``chain``.
Modules that do not serve it run as ``python -m andabata.bench.NAME``, single measurements as
``python -m andabata.bench.studies.NAME``, from the repository alone: a wheel has none of them.
``--help`` shows the options of each.
"""
