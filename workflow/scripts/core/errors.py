"""The one error type that is shown to the user without a traceback."""


class InputError(Exception):
    """Input that the user can correct. The message names the file or key, what is wrong and what would be right."""
