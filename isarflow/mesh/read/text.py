"""Read text files as numbers in lines, and the elements that a header announces there (PLY, OFF), or name the line."""

import io
from typing import NamedTuple

import numpy as np

from isarflow.core.errors import InputError
from isarflow.core.text import BOM, number

PADDING = b" \t\r\n\0\x1a"  # after a text; the last is the end of a file to DOS
COLOURS = 3, 4  # numbers; OFF files may give them to some faces alone, but not to one alone: that is a mistake


class Rows(NamedTuple):
    """A text's lines of numbers; empty ones are left out."""

    numbers: np.ndarray  # (N,) float64
    start: np.ndarray  # (R + 1,) the first number of each line, and N
    line: np.ndarray  # (R,) the lines' places in the file, from 1
    text: bytes  # of the file


def unix(data):
    """A text's bytes with line ends of one kind, without a byte-order mark and padding at its end."""
    return data.removeprefix(BOM).rstrip(PADDING).replace(b"\r\n", b"\n").replace(b"\r", b"\n") + b"\n"


def numbered(data):
    """Places, from 1, and contents of a text's lines, with any line end."""
    return enumerate(io.BytesIO(unix(data)), 1)


def quoted(place, line):
    return f"line {place}: {line.decode('latin-1').strip()[:80]!r}"


def point(words, place, line):
    """Three words as numbers, of the text and number of this line."""
    try:
        x, y, z = map(number, words)
    except ValueError:
        raise InputError(f"{quoted(place, line)} does not give three numbers x, y, z{_comma(line)}.") from None
    return x, y, z


def _comma(text):
    return "; decimals are written with a point, not a comma" if b"," in text else ""


def rows(text, skipped=0):
    """The Rows of a text (see `unix`) after so many bytes of header."""
    body, before = text[skipped:], text.count(b"\n", 0, skipped)
    lines = body.split(b"\n")
    count = np.array([len(line.split()) for line in lines])
    try:
        numbers = np.fromstring(body, sep=" ") if count.any() else np.empty(0)
    except ValueError:
        numbers = ()
    if len(numbers) != count.sum():  # one by one, to find the wrong one
        numbers = []
        for place, line in enumerate(lines, before + 1):
            for word in line.split():
                try:
                    numbers.append(number(word))
                except ValueError:
                    what = f"{word.decode('latin-1')!r} is not a number{_comma(word)}"
                    raise InputError(f"{quoted(place, line)}: {what}.") from None
    filled = np.flatnonzero(count)
    return Rows(np.array(numbers), np.append(0, np.cumsum(count[filled])), filled + before + 1, text)


def elements_of(found, elements):
    """The values of `elements`, [(name, count, [(property, type)])], in Rows, and the line of each, as two mappings.

    The values of a property are (count,), or for a list, whose type is two, its lengths and its entries one after the
    other. Each element has a line, which may go on after its last property, or numbers follow without regard to lines.
    """
    elements = [row for row in elements if row[2]]
    if not elements:
        return {}, {}
    start, line, announced = found.start, found.line, sum(count for _, count, _ in elements)
    if len(line) != announced:
        start = _one_by_one(found, elements)
        if start is None:
            said = " and ".join(f"{count} of '{name}'" for name, count, _ in elements)
            last = f"line {line[-1]} is the last" if len(line) else "there are none"
            short = "; it may have been cut short" if len(line) < announced else ""
            raise InputError(f"its header announces {said}, but {len(line)} lines of numbers follow ({last}){short}.")
        line = line[np.searchsorted(found.start, start[:-1], "right") - 1]
    values, lines, first = {}, {}, 0
    for name, count, properties in elements:
        mine = slice(first, first + count)
        lines[name] = line[mine]
        values[name] = _element(found, start[mine], start[1:][mine], line[mine], name, properties)
        first += count
    return values, lines


def _refuse(found, place, name, reason):
    line = found.text.split(b"\n")[place - 1]
    raise InputError(f"{quoted(place, line)} does not give a {name}: {reason}.")


def _one_by_one(found, elements):
    """Places where each element begins, and the last ends, if all numbers follow each other; None if they cannot."""
    numbers, start, at = found.numbers, [], 0
    as_long = len(set(np.diff(found.start)[:-1].tolist())) <= 1
    for _, count, properties in elements:
        if not as_long and at not in found.start:  # an element of a kind begins in a line
            return None
        for _ in range(min(count, len(numbers) + 1)):
            start.append(at)
            for _, kind in properties:
                size = numbers[at] if len(kind) == 2 and at < len(numbers) else 0
                if not 0 <= size <= len(numbers):
                    return None
                at += 1 + int(size)
    return np.array([*start, at]) if at == len(numbers) else None


def _element(found, start, end, line, name, properties):
    """The values by property of elements with numbers from `start` to `end`, each with its line."""
    numbers, values, size, at = found.numbers, {}, 0 * start, start
    for key, kind in properties:
        if (at >= end).any():
            k = (at >= end).argmax()
            _refuse(found, line[k], name, f"it has too few numbers for {', '.join(key for key, _ in properties)}")
        values[key], at = numbers[at], at + 1
        if len(kind) == 2:
            lengths = values[key]
            bad = ~((lengths >= 0) & (lengths <= end - at) & (lengths == np.floor(lengths)))
            if bad.any():
                k = bad.argmax()
                follow = end[k] - at[k]
                _refuse(found, line[k], name, f"it announces {lengths[k]:g} numbers in {key}, but {follow} follow")
            lengths = lengths.astype(np.int64)
            before = np.cumsum(lengths) - lengths
            values[key] = lengths, numbers[np.repeat(at - before, lengths) + np.arange(lengths.sum())]
            size, at = size + lengths, at + lengths
    k = _odd(size, end - at, name == "face")
    if k is not None:
        _refuse(found, line[k], name, f"not as many numbers follow after it ({end[k] - at[k]}) as on other lines")
    return values


def _odd(size, more, coloured):
    """The first row, or None, with an unusual number, `more`, of numbers after its list of `size`, not announced.

    With `coloured` some rows may have a colour.
    """
    if (more == more[:1]).all():
        return None
    plain = more == 0
    some = coloured and set(more.tolist()) in ({0, count} for count in COLOURS) and (~plain).sum() > 1
    if some and np.isin(size[plain], size[~plain]).all():
        return None
    kinds, count = np.unique(np.stack([size, more]), axis=1, return_counts=True)
    if (np.diff(kinds[0]) > 0).all() and (np.diff(kinds[1]) >= 0).all():  # it grows with the list: of each corner
        return None
    return (more != kinds[1, count.argmax()]).argmax()
