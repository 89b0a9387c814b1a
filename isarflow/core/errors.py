"""The one error type that is shown to the user without a traceback."""

from collections.abc import Callable
from typing import Any


class InputError(Exception):
    """Input that the user can correct. The message names the file or key, what is wrong and what would be right."""


def refusal(check: Callable[..., object], *arguments: Any) -> str:
    """The message with which a check refuses these arguments; '' if it lets them pass."""
    try:
        check(*arguments)
    except InputError as error:
        return str(error)
    return ""
