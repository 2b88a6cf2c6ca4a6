"""What a fit leaves: parameter files, tables, figures."""
