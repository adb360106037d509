"""The thesis's methods in the studio."""
