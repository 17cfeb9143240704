"""Reports of runs: one page of sections, each of blocks; begin with ``page.py`` and ``blocks.py``.

A module for each kind of run, ``folder.py`` and its neighbours read what the runs have written, and
``plots`` draws.
"""
