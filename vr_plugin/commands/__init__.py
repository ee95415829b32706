"""The commands that this package adds to the program; each in a file of its own."""
