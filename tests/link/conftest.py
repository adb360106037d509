"""Fixtures of the tests of links."""

from support.served_arm import served as served
