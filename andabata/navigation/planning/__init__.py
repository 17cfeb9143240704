"""From scans and clouds to a sub-goal and a safe command. Read ``local_planner.py`` first."""
