"""Counts in words, and the name that a misspelt one may mean, as logs, messages and the page say them."""

import difflib


def counted(counts):
    """Write a mapping of things to their numbers as '3 merged vertices, 1 united solid'; '' if there are none."""
    named = ((count, key.replace("_", " ")) for key, count in counts.items() if count)
    return ", ".join(f"{count:,} {_one(name) if count == 1 else name}" for count, name in named)


def _one(name):
    return f"{name.removesuffix('vertices')}vertex" if name.endswith("vertices") else name.removesuffix("s")


def near(name, names):
    """'; did you mean ...?' with the nearest name, upper or lower case alike, or a full stop."""
    spelt = {other.lower(): other for other in names}
    nearest = difflib.get_close_matches(str(name).lower(), spelt, n=1, cutoff=0.65)
    return f"; did you mean '{spelt[nearest[0]]}'?" if nearest else "."
