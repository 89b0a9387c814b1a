"""Which SNRs are one job: those that came together, as long as all of them are there."""

import pytest

from isarflow.setup import snr_sets

A, B, C = "snr_-3dB", "snr_0dB", "snr_3dB"


@pytest.fixture
def imaged(tmp_path):
    """A function that begins a run at some SNRs and makes their images; gives the sets that it had."""

    def run(*labels, written=True):
        parts = snr_sets.sets(tmp_path, labels)
        snr_sets.keep(tmp_path, parts)
        assert snr_sets.sets(tmp_path, labels, is_main=False) == parts  # what a job finds, at whatever time
        for label in labels if written else ():
            (tmp_path / "imaging/dart" / f"{label}.zarr").mkdir(parents=True, exist_ok=True)
        assert snr_sets.sets(tmp_path, labels, is_main=False) == parts
        return parts

    return run


def test_an_added_snr_is_a_set_of_its_own_from_then_on(imaged):
    assert imaged(A, B) == [[A, B]]
    assert imaged(A, B, C) == [[A, B], [C]]
    assert imaged(A, B, C) == [[A, B], [C]]
    assert imaged(C, A, B) == [[A, B], [C]]


def test_what_was_added_goes_without_the_others_noticing(imaged):
    imaged(A, B)
    imaged(A, B, C)
    assert imaged(A, B) == [[A, B]]


def test_what_is_made_again_goes_with_what_is_new(imaged):
    imaged(A, B)
    assert imaged(A, C) == [[A, C]]


def test_a_run_that_made_no_images_leaves_no_sets_behind(imaged):
    imaged(A, B, written=False)
    assert imaged(A, B, C) == [[A, B, C]]
