"""Which SNRs are one job: those that came together, as long as all of them are there."""

import pytest

from setup import together

A, B, C = "snr_-3dB", "snr_0dB", "snr_3dB"


@pytest.fixture
def predicted(tmp_path):
    """A function that begins a run at some SNRs and writes their tables; gives the sets that it had."""

    def run(*labels, written=True):
        parts = together.sets(tmp_path, labels)
        together.keep(tmp_path, parts)
        assert together.sets(tmp_path, labels, is_main=False) == parts  # what a job finds, at whatever time
        folder = tmp_path / "learning/predictions/closed/knn"
        folder.mkdir(parents=True, exist_ok=True)
        for label in labels if written else ():
            (folder / f"{label}.csv").touch()
        assert together.sets(tmp_path, labels, is_main=False) == parts
        return parts

    return run


def test_an_added_snr_is_a_set_of_its_own_from_then_on(predicted):
    assert predicted(A, B) == [[A, B]]
    assert predicted(A, B, C) == [[A, B], [C]]
    assert predicted(A, B, C) == [[A, B], [C]]
    assert predicted(C, A, B) == [[A, B], [C]]


def test_what_was_added_goes_without_the_others_noticing(predicted):
    predicted(A, B)
    predicted(A, B, C)
    assert predicted(A, B) == [[A, B]]


def test_what_is_predicted_again_goes_with_what_is_new(predicted):
    predicted(A, B)
    assert predicted(A, C) == [[A, C]]


def test_a_run_that_predicted_nothing_leaves_no_sets_behind(predicted):
    predicted(A, B, written=False)
    assert predicted(A, B, C) == [[A, B, C]]
