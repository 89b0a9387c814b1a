"""Numbers and counts in words, as logs, messages and the page say them, and the name that a misspelt one may mean."""

import difflib
import math

from isarflow.core.errors import InputError

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def counted(counts):
    """Write a mapping of things to their numbers as '3 merged vertices, 1 united solid'; '' if there are none."""
    named = ((count, key.replace("_", " ")) for key, count in counts.items() if count)
    return ", ".join(f"{count:,} {_one(name) if count == 1 else name}" for count, name in named)


def _one(name):
    return f"{name.removesuffix('vertices')}vertex" if name.endswith("vertices") else name.removesuffix("s")


def near(name, names):
    """'; did you mean ...?' with the nearest name, upper or lower case alike, or a full stop."""
    spelt = {known.lower(): known for known in names}
    nearest = difflib.get_close_matches(str(name).lower(), spelt, n=1, cutoff=0.65)
    return f"; did you mean '{spelt[nearest[0]]}'?" if nearest else "."


def check_word(name, given, known):
    """Raise InputError, saying what there is, unless an argument is one of the known words."""
    if given not in list(known):
        raise InputError(f"'{name}': {given!r} is none of {', '.join(known)}{near(given, known)}")


def check_words(name, given, known):
    """Raise InputError unless an argument is a list of known words."""
    if isinstance(given, str):
        raise InputError(f"'{name}' is a list of names, as ['{next(iter(known))}'], not the text {given!r}.")
    for word in given:
        check_word(name, word, known)


def number(value, digits=3):
    """A number as text with so many significant digits, without an exponent where it can be read without one."""
    if value is None or math.isnan(value):
        return "–"
    if value and not 1e-3 <= abs(value) < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa}×10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    return f"{value:.0f}" if abs(value) >= 10 ** (digits - 1) else f"{value:.{digits}g}"


def signed(value, decimals=3):
    """A difference with its sign; a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:+.{decimals}f}".replace("-", "−")


def duration(seconds):
    """A time as text in the unit that reads best."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.1f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def several(count, singular, plural=None):
    """A count with its noun as text."""
    return f"{count:,} {singular if count == 1 else plural or f'{singular}s'}"
