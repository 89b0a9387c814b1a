"""Numbers as other programs write them."""

import math

import pytest

from isarflow.core.text import number

SAME = {
    "1.5": 1.5,
    "-2": -2.0,
    "+.5E-3": 0.5e-3,
    "1.0D-03": 1e-3,
    "-1.5d+2": -150.0,
    "2D0": 2.0,
    ".25D1": 2.5,
    "1.234-105": 1.234e-105,
    "-9.9+101": -9.9e101,
    "1.-100": 1e-100,
    "Infinity": math.inf,
}
# Columns that ran together, a decimal comma, ranges, words, and what Python alone takes for a number.
WRONG = ["", "1,5", "1.5-3", "1-105", "1.500-3.000", "1.234-1055", "1.0D", "1.0D-3.5", "D5", "****", "1_000", "٣"]


@pytest.mark.parametrize("kind", [str, str.encode])
def test_a_word_is_the_number_that_its_program_meant(kind):
    assert {word: number(kind(word)) for word in SAME} == SAME
    assert math.isnan(number(kind("NaN")))


@pytest.mark.parametrize("word", WRONG)
def test_another_word_is_no_number(word):
    for of in (word, word.encode()):
        with pytest.raises(ValueError, match=r"number|could not convert"):
            number(of)
