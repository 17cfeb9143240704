"""Configurations from files and options, with errors that name the field or the option."""
