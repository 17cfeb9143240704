"""Curricula as data, and the runs that train them."""
