"""The room drawn: walls, eyes and volume as a picture, and live from outside."""
