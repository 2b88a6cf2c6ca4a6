"""Writes what a fit leaves: parameter files, tables, figures."""
