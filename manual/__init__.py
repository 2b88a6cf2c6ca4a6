"""Builds those pages of the manual that follow from the package. See mkdocs.yml."""
