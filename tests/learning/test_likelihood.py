"""The likelihood of the library against one by SciPy, its invariances, and what thresholds keep."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import eigh
from scipy.ndimage import uniform_filter
from scipy.optimize import minimize_scalar
from scipy.special import i0e, i1e
from scipy.stats import rice

from isarflow.core.errors import InputError
from isarflow.learning.classifier import OTHER, build_classifier
from isarflow.learning.evaluation.thresholds import choose
from isarflow.learning.models import likelihood
from isarflow.learning.models.likelihood import _cosine, _log_i0, _rician
from isarflow.learning.noise import LOADING, covariance
from isarflow.setup.config import ROOT

SHAPE = (3, 8, 7)  # channels, range, crossrange
SETTINGS = {"candidates": 8, "mismatch": 0.0}


def white(random, *shape):
    return ((random.standard_normal(shape) + 1j * random.standard_normal(shape)) / np.sqrt(2)).astype(np.complex64)


def coloured(random, count):
    """Noise as a window makes it: neighbours correlate and pixels differ in power, alike in all channels."""
    parts = white(random, count, *SHAPE)
    return (parts + 0.5 * np.roll(parts, 1, axis=-1)) * np.linspace(0.5, 1.5, SHAPE[1])[:, None]


def scenes(seed, count=60, classes=2, first=0):
    """Images of classes that differ by their scatterers' places, whose amplitudes and phases vary with the view."""
    random = np.random.default_rng(seed)
    images, labels = [], []
    for number in range(first, first + classes):
        mean = white(np.random.default_rng([9, number]), *SHAPE) ** 3
        images.append(mean * np.exp(1j * random.uniform(0, 2 * np.pi, (count, 1, 1, 1))))
        images[-1] = images[-1] + 0.1 * np.abs(mean) * white(random, count, *SHAPE)
        labels += [f"class{number}"] * count
    return np.concatenate(images).astype(np.complex64), np.array(labels)


def fitted(seed=0, classes=2, **settings):
    images, labels = scenes(1, classes=classes)
    model = build_classifier("likelihood", SETTINGS | settings, seed)
    model.noise = coloured(np.random.default_rng(5), 2000)
    return model.fit(images, labels)


def at_snr(images, snr, seed):
    """Images of unit energy with noise of this SNR over their pixels, of the colour that the model has learned."""
    images = images / np.linalg.norm(images.reshape(len(images), -1), axis=1)[:, None, None, None]
    noise = coloured(np.random.default_rng(seed), len(images))
    power = np.mean(np.abs(coloured(np.random.default_rng(6), 2000)) ** 2) * np.prod(SHAPE)
    return (images + 10 ** (-snr / 20) / np.sqrt(power) * noise).astype(np.complex64)


@pytest.fixture(scope="module")
def model():
    return fitted()


def largest(magnitudes, template, deviation):
    """The largest log-likelihood over the template's scale, by SciPy's density."""
    cost = minimize_scalar(
        lambda scale: -rice.logpdf(magnitudes, scale * template / deviation, scale=deviation).sum(),
        bounds=(0, 3),
        method="bounded",
    )
    return -cost.fun


@pytest.mark.parametrize("mismatch", [0, 0.05])
def test_rice_is_the_likelihood_by_scipy_less_that_of_the_best_magnitudes(mismatch):
    random = np.random.default_rng(0)
    magnitudes, templates = np.abs(white(random, 6, 30)), np.abs(white(random, 6, 4, 30))
    noise, around = random.uniform(0.05, 0.3, (6, 30)), templates**2 + 0.1
    found = _rician(*(np.float32(of) for of in (magnitudes, noise, np.ones(6), templates, around)), mismatch)
    for row, level in enumerate(np.asarray(found)):
        # At scale 1, with which it begins, the variance of view and noise together is fixed.
        variance = noise[row] + mismatch * around[row]

        deviations = np.sqrt(variance / 2)
        each = [
            largest(magnitudes[row], template, of)
            - sum(largest(r, 1, deviation) for r, deviation in zip(magnitudes[row], of, strict=True))
            for template, of in zip(templates[row], deviations, strict=True)
        ]
        assert level == pytest.approx(max(each), rel=0.01)


def test_the_bessel_functions_are_scipys():
    z = np.geomspace(1e-3, 1e4, 400).astype(np.float32)
    np.testing.assert_allclose(_log_i0(z), np.log(i0e(z.astype(float))) + z, rtol=2e-6, atol=2e-6)
    exact = i1e(z.astype(float)) / i0e(z.astype(float))
    assert (_cosine(z) <= exact * (1 + 1e-6)).all() and (_cosine(z) > 0.94 * exact).all()


def test_coherence_is_its_formula(monkeypatch):
    monkeypatch.setattr(likelihood, "WEAK", -np.inf)  # no direction is left out
    model = fitted()
    tests = at_snr(scenes(3, count=4)[0], 0, 1)
    rows = tests.reshape(len(tests), -1) / np.linalg.norm(tests.reshape(len(tests), -1), axis=1)[:, None]
    share = np.full(len(rows), 0.4, np.float32)
    noise = model.noise.reshape(-1, SHAPE[1] * SHAPE[2])
    noise = noise / np.linalg.norm(noise, axis=1, keepdims=True)
    of_noise = np.kron(np.eye(3), noise.T @ noise.conj() / len(noise)) / 3
    of_noise += 0.01 / len(of_noise) * np.eye(len(of_noise))
    t = model.templates_.astype(complex)
    inverse = np.linalg.inv(0.6 * t.T @ t.conj() / len(t) + 0.4 * of_noise)
    found = np.abs(rows @ inverse.T @ t.conj().T) ** 2
    found /= np.einsum("ni,ij,nj->n", t.conj(), inverse, t).real
    found /= np.einsum("ni,ij,nj->n", rows.conj(), inverse, rows).real[:, None]
    expected = -rows.shape[1] * np.log(1 - np.maximum.reduceat(found, model.starts_[:-1], axis=1))
    near, rows = np.zeros((len(rows), len(t))), rows.astype(np.complex64)
    np.testing.assert_allclose(model._coherence(rows, share, None, near), expected, rtol=1e-3, atol=1e-2)
    # Of large classes only the nearest are tried: all of them here.
    monkeypatch.setattr(likelihood, "MANY", 1)
    np.testing.assert_allclose(model._coherence(rows, share, None, near), expected, rtol=1e-3, atol=1e-2)


def test_large_classes_try_the_nearest_templates_alone(monkeypatch):
    model = fitted()
    tests = at_snr(scenes(3, count=4)[0], 20, 1)
    whole = model.evaluate(tests)
    monkeypatch.setattr(likelihood, "MANY", 1)
    monkeypatch.setattr(likelihood, "SIFTED", 8)
    sifted = model.evaluate(tests)
    np.testing.assert_array_equal(sifted.known["rice"], whole.known["rice"])
    np.testing.assert_array_equal(sifted.labels, whole.labels)
    assert (sifted.known["coherence"] <= whole.known["coherence"] + 1e-3).all()
    # A view that the library has is its own nearest template.
    of_library = model.templates_[::7].reshape(-1, *model.shape_)
    np.testing.assert_allclose(
        model.evaluate(of_library).known["coherence"].min(), -model.templates_.shape[1] * np.log(1e-6), rtol=0.5
    )


def level(r, a, v):
    """What the log of Rice's density of r has of a, by SciPy's Bessel function."""
    return np.log(i0e(2 * r * a / v)) + 2 * r * a / v - a**2 / v


def reference(model, images, labels, tests):
    """Rice and coherence of each test and class (n, 2, classes), image by image and template by template."""
    flat = [of.reshape(len(of), -1).astype(complex) for of in (images, tests)]
    library, x = (of / np.linalg.norm(of, axis=1, keepdims=True) for of in flat)
    noise = model.noise.reshape(-1, SHAPE[1] * SHAPE[2]).astype(complex)
    noise = noise / np.linalg.norm(noise, axis=1, keepdims=True)
    of_noise = np.kron(np.eye(SHAPE[0]), noise.T @ noise.conj() / len(noise)) / SHAPE[0]
    each, classes = np.diag(of_noise).real, np.unique(labels)
    loaded = of_noise + LOADING / len(of_noise) * np.eye(len(of_noise))
    powers, basis = eigh(library.T @ library.conj() / len(library), loaded)
    powers, basis = powers[powers > likelihood.WEAK], basis[:, powers > likelihood.WEAK]
    found = np.zeros((len(x), 2, len(classes)))
    for row, (image, magnitudes) in enumerate(zip(x, np.abs(x), strict=True)):
        share = np.quantile(magnitudes**2 / each, 0.25) / -np.log(0.75)
        inverse = 1 / ((1 - max(share, 0.3)) * powers + max(share, 0.3))
        for column, name in enumerate(classes):
            mine = library[labels == name]
            alike = [np.corrcoef(magnitudes, np.abs(one))[0, 1] for one in mine]
            scores = []
            for a in np.abs(mine[np.argsort(alike)[-model.settings["candidates"] :]]):
                around = uniform_filter((a**2).reshape(SHAPE), (1, 3, 3), mode="nearest").ravel()
                v = share * each + (1 - share) * model.settings["mismatch"] * around
                z = 2 * magnitudes * np.sqrt(1 - share) * a / v
                s = (magnitudes * a / v * i1e(z) / i0e(z)).sum() / (a**2 / v).sum()
                best = magnitudes
                for _ in range(300):
                    best = magnitudes * i1e(2 * magnitudes * best / v) / i0e(2 * magnitudes * best / v)
                scores.append((level(magnitudes, s * a, v) - level(magnitudes, best, v)).sum())
            found[row, 0, column] = max(scores)
            t, y = mine @ basis.conj(), image @ basis.conj()
            c = np.abs((t.conj() * inverse) @ y) ** 2 / ((np.abs(t) ** 2 @ inverse) * (np.abs(y) ** 2 @ inverse))
            found[row, 1, column] = -len(image) * np.log(1 - c.max())
    return found


@pytest.mark.parametrize("snr", [-3, 9])
def test_scores_are_the_formulas_from_images_to_the_end(snr):
    images, labels = scenes(1)
    model, tests = fitted(mismatch=0.05), at_snr(scenes(3, count=2)[0], snr, 1)
    outcome, expected = model.evaluate(tests), reference(model, images, labels, tests)
    both = expected[:, 0] + likelihood.COHERENCE * expected[:, 1]
    np.testing.assert_allclose(outcome.scores, both, rtol=0.01, atol=1)
    for number, name in enumerate(("rice", "coherence")):
        np.testing.assert_allclose(outcome.known[name], expected[:, number].max(axis=1), rtol=0.01, atol=1)
    np.testing.assert_allclose(outcome.known["likelihood"], both.max(axis=1), rtol=0.01, atol=1)


def test_a_second_fit_forgets_the_first():
    model, tests = fitted(), at_snr(scenes(3)[0], 9, 1)
    model.evaluate(tests)
    model.fit(*scenes(1, classes=3))
    again = build_classifier("likelihood", SETTINGS, 0)
    again.noise = model.noise
    np.testing.assert_array_equal(model.evaluate(tests).scores, again.fit(*scenes(1, classes=3)).evaluate(tests).scores)


def test_phase_and_scale_change_nothing(model):
    tests = at_snr(scenes(3)[0], 3, 1)
    one, other = model.evaluate(tests), model.evaluate((tests * 40 * np.exp(2j)).astype(np.complex64))
    np.testing.assert_allclose(one.scores, other.scores, rtol=1e-4, atol=0.02)
    assert (one.labels == other.labels).all()


def test_the_order_of_polarizations_changes_nothing(model):
    images, labels = scenes(1)
    turned = build_classifier("likelihood", SETTINGS, 0)
    turned.noise = model.noise[:, ::-1]
    turned.fit(images[:, ::-1], labels)
    tests = at_snr(scenes(3)[0], 0, 1)
    np.testing.assert_allclose(
        model.evaluate(tests).scores, turned.evaluate(tests[:, ::-1]).scores, rtol=2e-3, atol=0.3
    )


def compare_bits():
    """Scores of images alone and among others, as `test_the_others_of_a_batch_change_no_bit` runs it."""
    model, tests = fitted(), at_snr(scenes(3)[0], 0, 1)
    whole, alone = model.evaluate(tests), [model.evaluate(tests[place : place + 1]) for place in (0, 63, 64, 119)]
    for place, one in zip((0, 63, 64, 119), alone, strict=True):
        np.testing.assert_array_equal(one.scores[0], whole.scores[place])


def test_the_others_of_a_batch_change_no_bit():
    """On one thread, as in a job: among several, BLAS divides a product, on some processors so that bits differ."""
    path = os.pathsep.join([str(ROOT), str(Path(__file__).parent)])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NPROC"), "1")
    command = [sys.executable, "-c", "import test_likelihood; test_likelihood.compare_bits()"]
    subprocess.run(command, env=os.environ | threads | {"PYTHONPATH": path}, check=True)


@pytest.mark.parametrize("snr", [-12, 0, 6, 20])
def test_a_threshold_by_known_views_keeps_the_share_that_it_says(model, snr):
    """Of views and noise that are others than those it was chosen by."""
    chosen, tested = (model.evaluate(at_snr(scenes(seed, count=4000)[0], snr, seed)).known for seed in (7, 8))
    table = pd.DataFrame({"side": "validation", "role": "known", "truth": "", "predicted": "", **chosen})
    for name in chosen:
        assert (tested[name] >= choose(table, name, "kept", 0.95)).mean() == pytest.approx(0.95, abs=0.01)


def test_known_views_are_told_from_others(model):
    known, labels = scenes(8)
    outcome, strange = model.evaluate(at_snr(known, 10, 4)), model.evaluate(at_snr(scenes(8, first=5)[0], 10, 4))
    assert (outcome.labels == labels).all()
    for name, scores in outcome.known.items():
        assert (strange.known[name] < np.quantile(scores, 0.05)).mean() > 0.95


def test_what_is_no_class_is_learned_as_the_class_other(tmp_path):
    images, labels = scenes(1, classes=3)
    labels[labels == "class2"] = OTHER
    model = build_classifier("likelihood", SETTINGS, 0)
    model.noise = coloured(np.random.default_rng(5), 300)
    model.fit(images, labels)
    outcome = model.evaluate(at_snr(images, 20, 7))
    known = labels != OTHER
    assert (outcome.labels[known] == labels[known]).mean() > 0.95
    assert ((outcome.known["likelihood"] > 0) == known).mean() > 0.95
    known_less_other = outcome.scores[:, :2].max(axis=1) - outcome.scores[:, 2]
    np.testing.assert_allclose(outcome.known["likelihood"], known_less_other, rtol=1e-5)
    model.save(tmp_path)
    loaded = build_classifier("likelihood", SETTINGS, 0).load(tmp_path)
    np.testing.assert_array_equal(loaded.evaluate(images).scores, model.evaluate(images).scores)
    zero = model.evaluate(np.zeros((1, *SHAPE), np.complex64))
    assert np.isfinite(zero.scores).all() and all(np.isfinite(of).all() for of in zero.known.values())


def of_noise(noise):
    """What the model takes for the noise's covariance from these images of noise alone."""
    return covariance(noise, np.array(SHAPE), "likelihood")


@pytest.mark.parametrize("case", ["none", "empty", "other pixels", "not finite"])
def test_without_images_of_noise_there_is_one_message(case):
    noise = coloured(np.random.default_rng(5), 40)
    given = {"none": None, "empty": noise[:0], "other pixels": noise[..., 1:], "not finite": noise * np.nan}
    asked = re.escape(f"(m, {', '.join(map(str, SHAPE))})")
    with pytest.raises(InputError, match=rf"learns from images of noise alone, {asked}; .*'noise' is"):
        of_noise(given[case])


def test_empty_images_of_noise_say_nothing_of_it():
    """As those of an imager that finds points: the others count alone, and without any the noise is white."""
    noise, pixels = coloured(np.random.default_rng(5), 40), np.prod(SHAPE)
    np.testing.assert_allclose(of_noise(np.concatenate([0 * noise, noise])), of_noise(noise), atol=1e-8)
    np.testing.assert_allclose(of_noise(0 * noise), np.eye(pixels) / pixels, rtol=1e-12)
