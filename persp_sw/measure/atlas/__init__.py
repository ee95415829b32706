"""The stability atlas: the ways in which volume renderers fail, as cases that measure ours beside bounds."""
