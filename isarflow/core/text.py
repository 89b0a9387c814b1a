"""Numbers and the byte-order mark, as text files of other programs have them: for every reader of text."""

import re

BOM = b"\xef\xbb\xbf"  # some editors put it in front of text; as characters, the encoding "utf-8-sig" takes it away
# 1.0D-03, and 1.0-103: a Fortran program leaves the letter out where the exponent has three digits.
FORTRAN = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))[Dd]([+-]?\d+)|([+-]?(?:\d+\.\d*|\.\d+))([+-]\d{3})", re.ASCII)


def number(word: str | bytes) -> float:
    """A word as a number, also in Fortran's forms, NaN and infinity included. Raises ValueError for any other word."""
    text = word if isinstance(word, str) else word.decode("latin-1")
    if "_" in text or not text.isascii():  # Python's own: 1_000 is 1000, and digits may be of any script
        raise ValueError(f"{text!r} is not a number")
    try:
        return float(text)
    except ValueError:
        fortran = FORTRAN.fullmatch(text)
        if not fortran:
            raise
        return float("e".join(part for part in fortran.groups() if part))
