"""Files that are written in one piece, and the user's cache."""
