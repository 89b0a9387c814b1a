"""The report in a browser: nothing is asked of a network, everything is drawn, readable by all, and answers."""

import copy
import json
import re
import shutil

import fake
import matplotlib
import numpy as np
import pytest
import xarray as xr

from report.draw_images import FLOOR_DB, decibels

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
if CHROMIUM is None:
    pytest.skip("no Chromium on this machine", allow_module_level=True)
playwright = pytest.importorskip("playwright.sync_api", reason="envs/requirements-browser.lock is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="see envs/requirements-browser.lock")

WIDTHS = (1280, 400)


@pytest.fixture(scope="module")
def browser():
    # Chromium's sandbox wants rights that containers do not have; its own services would ask for the network.
    arguments = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


class View:
    """The page in a window of some width; what it said on the console, and what it asked for."""

    def __init__(self, browser, report, width, **options):
        self.page = browser.new_page(viewport={"width": width, "height": 900}, **options)
        self.page.set_default_timeout(20_000)
        self.said, self.asked = [], []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(f"file://{report}/index.html")


@pytest.fixture(scope="module", params=WIDTHS)
def view(request, browser, whole):
    return View(browser, whole, request.param)


@pytest.fixture
def page(browser, whole):
    view = View(browser, whole, 1280)
    yield view.page
    assert view.said == []
    view.page.close()


def test_page_is_quiet_and_asks_nothing_of_anyone(view, whole):
    assert view.said == []
    others = [url for url in view.asked if not url.startswith("data:")]
    assert others == [f"file://{whole}/index.html"]


def test_every_picture_is_drawn(view):
    pictures = view.page.eval_on_selector_all(
        "img", "all => all.map(one => [one.alt, one.complete, one.naturalWidth, one.clientWidth])"
    )
    assert len(pictures) > 30
    assert [alt for alt, complete, natural, shown in pictures if not (complete and natural and shown)] == []
    # The canvases of the viewer, and the plot, have something in them.
    for name in ("explore-mesh", "explore-image"):
        colors = view.page.evaluate(f"({COLORS})('{name}')")
        assert len(colors) > 5, name
    assert view.page.locator("#compare-plot polyline").count() > 1


# How many of the canvas's pixels have which colour.
COLORS = """name => {
  const canvas = document.getElementById(name), found = {};
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", {willReadFrequently: true});
  copy.drawImage(canvas, 0, 0);
  const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  for (let k = 0; k < pixels.length; k += 4) {
    const color = pixels.slice(k, k + 4).join();
    found[color] = (found[color] || 0) + 1;
  }
  return found;
}"""


def test_nothing_runs_out_of_the_window(view):
    widths = view.page.evaluate("[document.scrollingElement.scrollWidth, innerWidth]")
    assert widths[0] <= widths[1]
    # What is wider than the window scrolls in a box of its own; all else lies inside.
    beyond = view.page.evaluate(
        """[...document.querySelectorAll("main *, header *")].filter((one) => {
          const box = one.getBoundingClientRect();
          return box.width && box.right > innerWidth + 1 && !one.closest(".scroll, pre, .skip");
        }).map((one) => one.outerHTML.slice(0, 80))"""
    )
    assert beyond == []


def test_no_serious_barrier_for_anyone(view):
    found = axe.Axe().run(view.page).response["violations"]
    serious = [
        (one["id"], [node["html"][:100] for node in one["nodes"]][:3])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]
    assert serious == []


def test_the_first_screen_says_what_was_run_and_what_came_out(page):
    shown = page.evaluate(
        """[...document.querySelectorAll(".facts dt, .targets strong, #figure-headline img, h1")]
          .filter((one) => one.getBoundingClientRect().top < innerHeight).map((one) => one.innerText || one.alt)"""
    )
    assert {"Run", "Radar", "Aspect", "Images", "Noise", "Computed in", "Made with"} <= set(shown)
    assert {"drone", "missile", "ufo"} <= set(shown)
    assert any(text.startswith("Weighted F1 against test SNR") for text in shown)


def test_the_viewer_shows_the_image_of_the_store(page, whole):
    page.select_option("[name=target]", label="ufo")
    page.select_option("[name=snr]", label="12 dB")
    page.focus("[name=azimuth]")
    for _ in range(2):
        page.keyboard.press("ArrowRight")
    caption = page.inner_text("#explore-caption")
    said = re.fullmatch(r"ufo at azimuth ([\d.]+)°, elevation 0°: .* at an SNR of 12 dB \(peak_3db, .*\)\.", caption)
    store = xr.open_zarr(whole.parent / "imaging" / "ufo" / "snr_12dB.zarr").image.isel(realization=0)
    levels = decibels(store.sel(azimuth=float(said[1]), elevation=0, method="nearest").values)
    # A share of the canvas has each pixel's colour: compare the colours of the whole image, as they are counted.
    colors = page.evaluate(f"({COLORS})('explore-image')")
    colors = np.array([[*map(int, color.split(","))] for color, count in colors.items() if count > 200])[:, :3]
    viridis = matplotlib.colormaps["viridis"]
    expected = 255 * viridis(np.clip(1 - levels.ravel() / FLOOR_DB, 0, 1))[:, :3]
    step = 255 * np.abs(np.diff(viridis(np.arange(256))[:, :3], axis=0)).max()
    distance = np.abs(expected[:, None] - colors[None]).max(axis=2).min(axis=1)
    assert distance.max() <= step + 1
    assert len(np.unique(np.round(expected), axis=0)) > 3


def test_the_viewer_turns_the_mesh_and_keeps_the_snr(page):
    before = page.evaluate(f"({COLORS})('explore-mesh')")
    page.select_option("[name=snr]", label="0 dB")
    page.focus("[name=elevation]")
    page.keyboard.press("ArrowRight")
    assert page.evaluate(f"({COLORS})('explore-mesh')") != before
    page.select_option("[name=target]", label="missile")
    assert page.locator("[name=snr] option:checked").inner_text() == "0 dB"
    assert "missile at azimuth" in page.inner_text("#explore-caption")
    assert "elevation 30°" in page.inner_text("#explore-caption")


def test_the_viewer_stays_with_a_target_that_has_no_noisy_images(browser, tmp_path):
    """As an unknown target where no experiment is tested on it."""
    settings = copy.deepcopy(fake.SETTINGS)
    settings["learning"]["experiments"] = {}
    view = View(browser, fake.write(tmp_path / "fake", settings), 1280)
    view.page.select_option("[name=snr]", label="0 dB")
    view.page.select_option("[name=target]", label="ufo")
    assert view.page.locator("[name=snr] option").all_inner_texts() == ["no noise"]
    assert view.page.inner_text("#explore-caption").startswith("ufo at azimuth")
    assert view.said == []
    view.page.close()


def test_experiments_are_switched_on_and_off(page, whole):
    data = json.loads(page.inner_text("#compare-data"))["curves"]
    names = lambda: page.locator("#compare-legend li").all_inner_texts()  # noqa: E731
    page.check("input[value='closed set']")
    for group in ("experiment", "model"):
        boxes = page.locator(f"input[name={group}]")
        for box in boxes.all():
            box.uncheck()
    assert [name[:15] for name in names()] == ["Nothing to show"]
    page.click("button[data-all=model]")
    page.check("input[value='multi elevation']")
    expected = [one["words"] for one in data if one["set"] == "closed set" and one["experiment"] == "multi elevation"]
    assert names() == expected and len(expected) == 2
    assert page.locator("#compare-plot g.curve").count() == 2
    page.check("input[value='open set, thesis thresholds']")
    page.uncheck("input[value='multi elevation']")
    page.check("input[value='noisy capsule']")
    only_best = names()
    page.check("[name=every]")
    assert len(names()) > len(only_best) == 2
    assert page.locator("#compare-plot title").first.text_content().endswith("at -12 dB")


def test_one_fold_has_no_band_and_the_axis_names_the_definition_of_snr(page):
    page.check("input[value='closed set']")
    for box in page.locator("input[name=experiment]").all():
        box.uncheck()
    for experiment, bands in (("capsule sector", 0), ("capsule open", 1)):
        page.check(f"input[value='{experiment}']")
        page.check("input[name=model][value='capsule']")
        assert page.locator("#compare-plot g.curve").count() == 1
        assert page.locator("#compare-plot polygon.band").count() == bands
        assert ("[" in page.locator("#compare-plot title").first.text_content()) == bool(bands)
        page.uncheck(f"input[value='{experiment}']")
    assert page.get_by_text("test SNR by peak_3db power [dB]").count() == 1


def test_without_scripts_the_page_says_so_and_keeps_its_figures(browser, whole):
    view = View(browser, whole, 1280, java_script_enabled=False)
    assert view.page.get_by_text("This viewer needs JavaScript").is_visible()
    assert view.page.locator("#figure-headline img").is_visible()
    assert view.said == []


def test_on_paper_there_is_nothing_to_press_or_to_scroll(page):
    page.emulate_media(media="print")
    assert not page.locator(".controls").first.is_visible()
    assert not page.locator("nav").is_visible()
    overflow = page.eval_on_selector_all(".scroll", "all => all.map((one) => getComputedStyle(one).overflowX)")
    assert set(overflow) == {"visible"}
    assert len(page.pdf(format="A4")) > 100_000
