"""The commands of `persp-sw`, one module each."""
