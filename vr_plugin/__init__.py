"""Walls, tracking and stereo windows; nothing here yet."""
