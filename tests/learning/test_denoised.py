"""Models that take noise out of images in front of another: their closed forms, and the model behind them."""

import json

import numpy as np
import pytest

from isarflow.learning.classifier import CONFIG, build_classifier
from isarflow.learning.conformance import of_face, of_fitted, of_restored
from isarflow.learning.noise import covariance, loaded

SHAPE = 2, 4, 3
PIXELS = np.prod(SHAPE)
WIENER = {"of": "zncc"}
AUTOENCODER = WIENER | {"width": 48, "epochs": 8, "batch": 64, "learning_rate": 0.003}


def drawn(random, count, powers):
    """Images (count, *SHAPE) of circular Gaussian numbers of these powers (N,) in one basis of waves."""
    parts = random.standard_normal((count, PIXELS, 2)) @ [1, 1j] * np.sqrt(powers / 2)
    return (parts @ np.fft.fft(np.eye(PIXELS), norm="ortho")).reshape(-1, *SHAPE)


def noise():
    """White noise, all channels alike."""
    return drawn(np.random.default_rng(1), 4000, np.ones(PIXELS)).astype(np.complex64)


def library():
    random = np.random.default_rng(0)
    images = drawn(random, 3000, PIXELS * 0.5 ** np.arange(PIXELS)).astype(np.complex64)
    return images, np.where(np.abs(images[:, 0, 0, 0]) > 1, "one", "two")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of a run with a fitted model `zncc`."""
    path = tmp_path_factory.mktemp("run") / "zncc"
    path.mkdir()
    settings = {"features": "magnitude"}
    build_classifier("matched_filter", settings, 0).fit(*library()).save(path)
    config = {"kind": "matched_filter", "settings": settings, "seed": 0, "run": {"motion": {}}}
    (path / CONFIG).write_text(json.dumps(config))
    return path.parent


def fitted(folder, kind="wiener", settings=None):
    model = build_classifier(kind, settings or WIENER, 0)
    model.noise, model.beside = noise(), folder
    return model.fit(*library())


def noisy(share, count=2000):
    """Clean images of the library's kind, each of energy 1 - share, and the same with that share of noise."""
    random = np.random.default_rng(7)
    clean = drawn(random, count, 0.5 ** np.arange(PIXELS))
    clean *= np.sqrt((1 - share) / (np.abs(clean) ** 2).sum(axis=(1, 2, 3), keepdims=True))
    return clean, clean + drawn(random, count, np.full(PIXELS, share / PIXELS))


def test_the_gain_is_the_closed_form(folder, monkeypatch):
    model, (images, _) = fitted(folder), library()
    rows = images.reshape(len(images), -1).astype(complex)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    r = rows.T @ rows.conj() / len(rows)
    q = loaded(covariance(noise(), SHAPE, "test"))
    _, seen = noisy(0.5, 5)
    seen = seen.astype(np.complex64)
    for share in (0.001, 0.2, 0.9):
        monkeypatch.setattr("isarflow.learning.noise.share", lambda x, _, n=share: np.full(len(x), n, np.float32))
        gain = (1 - share) * r @ np.linalg.inv((1 - share) * r + share * q)
        x = seen.reshape(5, -1) / np.linalg.norm(seen.reshape(5, -1), axis=1, keepdims=True)
        made = model.denoised(seen).reshape(5, -1)
        np.testing.assert_allclose(made, x @ gain.T, atol=1e-4)  # 2.1e-5, in single precision


def test_no_other_gain_in_its_basis_has_a_smaller_error(folder, monkeypatch):
    """On draws of noise: a gain of each direction a tenth larger or smaller, and none at all, err more."""
    model, share = fitted(folder), 0.4
    clean, seen = noisy(share)
    # The mean over draws: each image has unit energy on average alone.
    x, aim = (of.reshape(len(of), -1) for of in (seen, clean))
    p = model.powers_
    gain = (1 - share) * p / ((1 - share) * p + share)

    def error(gain):
        return (np.abs(x @ model.basis_ * gain @ model.back_ - aim) ** 2).sum(axis=1).mean()

    least = error(gain)
    assert least < min(error(0.9 * gain), error(1.1 * gain), error(gain**0.8), error(gain**1.25))
    # The closed form: the sum of the noise's and the signal's remaining powers.
    assert least == pytest.approx((share * (1 - share) * p / ((1 - share) * p + share)).sum() / PIXELS, rel=0.05)
    monkeypatch.setattr("isarflow.learning.noise.share", lambda x, _: np.full(len(x), share, np.float32))
    made = model.denoised(seen.astype(np.complex64)).reshape(len(x), -1)
    made *= np.linalg.norm(x, axis=1, keepdims=True)
    assert (np.abs(made - aim) ** 2).sum(axis=1).mean() == pytest.approx(least, rel=0.05)
    assert least < 0.4 * share


def test_images_without_noise_pass_unchanged(folder):
    images, model = library()[0].copy(), fitted(folder)
    images[:, :, :2, :] *= 1e-3  # faint pixels, by which there is no noise
    model.learn(images)
    rows, made = (of[:50].reshape(50, -1) for of in (images, model.denoised(images)))
    along = np.abs((rows.conj() * made).sum(axis=1)) / np.linalg.norm(rows, axis=1)
    assert along.min() > 0.99


@pytest.mark.parametrize(("kind", "settings"), [("wiener", WIENER), ("autoencoder", AUTOENCODER)])
def test_the_model_behind_judges_the_images(kind, settings, folder, tmp_path):
    model, (images, labels) = fitted(folder, kind, settings), library()
    outcome = model.evaluate(images[:70])
    made = model.denoised(images[:70])
    expected = model.member.evaluate(made / np.abs(made).max(axis=(1, 2, 3), keepdims=True))
    np.testing.assert_allclose(outcome.scores, expected.scores, atol=1e-5)
    assert not [*of_face(model), *of_fitted(model, labels, images)]
    own = folder / f"{kind}_kept"
    own.mkdir(exist_ok=True)
    model.save(own)
    assert not [*of_restored(model, build_classifier(kind, settings, 0), own, images)]
    empty = model.evaluate(np.zeros((1, *SHAPE), np.complex64))
    assert np.isfinite(empty.scores).all()


def test_the_autoencoder_takes_out_most_of_the_noise(folder):
    """At two levels: what is left is less than the noise, more than the least that a linear estimate leaves."""
    model = fitted(folder, "autoencoder", AUTOENCODER)
    for share in (0.1, 0.5):
        clean, seen = (of.reshape(len(of), -1) for of in noisy(share))
        made = model.denoised(seen.reshape(-1, *SHAPE).astype(np.complex64)).reshape(len(seen), -1)
        # Of unit energy in, of unit energy aimed at.
        error = (np.abs(made - clean / np.sqrt(1 - share)) ** 2).sum(axis=1).mean()
        assert error < 0.75 * share / (1 - share), share
    once, again = (fitted(folder, "autoencoder", AUTOENCODER | {"epochs": 1}).hidden_ for _ in range(2))
    np.testing.assert_array_equal(once, again)
