"""Rigid poses, and products of small matrices that are the same everywhere."""
