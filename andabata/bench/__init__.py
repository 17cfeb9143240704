"""Benchmarks: speed and accuracy of this project and of its peers, and where the numbers come from.

``andabata bench`` runs ``speed``, ``perception``, ``localization``, ``vehicle`` and ``chain``. The
other modules run as ``python -m andabata.bench.NAME``, and ``--help`` shows their options.
"""
