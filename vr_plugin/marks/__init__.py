"""Marks on screens and walls: what hands do with them, what eyes see of them, and how OpenGL draws them."""
