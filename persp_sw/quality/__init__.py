"""Steady frames: which accuracy can be afforded in the time a frame has."""
