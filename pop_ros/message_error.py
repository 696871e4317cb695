"""What is raised for messages that no frame can be made of."""

from pop_core.errors import PopError


class BadMessageError(PopError):
    """A message that no frame can be made of; the text says what was expected and found."""
