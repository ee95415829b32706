"""The desktop preview: cameras, its controller, and what draws it."""
