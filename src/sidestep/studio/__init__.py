"""The studio: the real loop, seen and touched in a browser."""
