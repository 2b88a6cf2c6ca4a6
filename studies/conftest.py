"""Shared with the tests of the package."""

from tests.conftest import bed

__all__ = ["bed"]
