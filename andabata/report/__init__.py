"""Reports of runs: one page with sections and figures; begin with ``page.py``.

A module for each kind of run, ``folder.py`` and its neighbours read what the runs have written, and
``plots`` draws.
"""
