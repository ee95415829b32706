"""Rig files: read, checked, written; and what of a rig one machine can show."""
