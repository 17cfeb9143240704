"""Single measurements behind figures and choices: ``python -m andabata.bench.studies.NAME``.

``--help`` shows the options of each.
"""
