"""The robot: its machine, localisation, navigation, tasks, records and command line.

Read ``navigation/navigator.py`` first: its ``step`` tells the whole story.
"""
