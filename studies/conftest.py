"""Shared with the tests of the package."""

from tests.conftest import bed, refused_by_study

__all__ = ["bed", "refused_by_study"]
