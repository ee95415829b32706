"""Programs of others that show our volume, to read and to run."""
