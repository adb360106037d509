"""Second implementations and random scenes that several test folders share."""
