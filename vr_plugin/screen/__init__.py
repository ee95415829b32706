"""Parts of windows: events, monitors, pictures of eyes, shapes and text in OpenGL."""
