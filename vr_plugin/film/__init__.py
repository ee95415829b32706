"""Films: where the camera goes, what each frame shows, and how frames become a file."""
