"""What is wrong with what the user gave us."""


class InputError(ValueError):
    """One line that names the place, what was expected there and what was found."""
