"""Runs the command line as `python -m drake_racket.cli`."""

from drake_racket.cli import main

main()
