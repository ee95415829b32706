"""Published experiments, repeated with this renderer."""
