"""Decoding of messages: from the messages of any driver to sensor readings in SI units.

``sensor_decoder.py`` comes first. Units, signs and zeros that messages do not tell are inferred
from the readings themselves.
"""
