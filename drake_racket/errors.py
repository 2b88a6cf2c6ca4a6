"""The one exception that bad input raises."""

from __future__ import annotations


class InputError(ValueError):
    """A value from outside that cannot be used.

    The message is one line: the key (or file), the value as given, and what is allowed.
    The command line prints it and exits with status 2.
    """

    def __init__(self, key: str, value: object, allowed: str) -> None:
        self.key = key
        self.value = value
        self.allowed = allowed
        super().__init__(f"{_one_line(key)}: got {_shown(value)}; allowed: {_one_line(allowed)}")


def _shown(value: object, limit: int = 80) -> str:
    """`value` on one line, shortened to `limit` characters."""
    try:
        text = repr(value)
    except ValueError:  # an int beyond sys.get_int_max_str_digits()
        text = f"an integer of {value.bit_length()} bits" if isinstance(value, int) else "a value"
    text = _one_line(text)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _one_line(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in str(text))
