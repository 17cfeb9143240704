"""Verbs of the command line, a module each: options, one call, one table.

Heavy imports are inside the functions, so that ``andabata --help`` is quick.
"""
