"""Runs of a rig: in windows, or without a screen."""
