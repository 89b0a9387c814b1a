"""The page "the thesis, figure by figure": what it published, what a run has, why they differ. Markdown and PNGs."""

from datetime import date
from pathlib import Path

from core import sweep
from report import thesis_chapter4, thesis_chapter5, thesis_slips
from report.conditions import noise_words
from report.layout import duration, style
from report.results import Results
from report.section_run import commit, networks, version
from report.thesis_compare import STATED, counted, kept_text, value_text
from report.thesis_markdown import anchor, block, bullets, not_here, pictures, table
from report.thesis_reasons import everywhere

PAGE = "README.md"
CHAPTERS = {
    "Chapter 4: classifiers without networks": thesis_chapter4.ENTRIES,
    "Chapter 5: networks": thesis_chapter5.ENTRIES,
    "The document itself": (thesis_slips.slips,),
}
LEARNING = ("train", "predict", "reconstruct", "timing", "scores")  # steps of the learning stage, as jobs are recorded
READ = (
    "Values of the document are those that it prints in text and tables; its curves are not read off. Where it says "
    "'above 9 dB', the next SNR of its grid, 12 dB, is taken. Values here stand with their 95 % intervals, at SNRs by "
    "mean power. Open markers in figures are published: ▲ at least, ▼ at most, ● equal to. A statement holds if the "
    "value, rounded to the printed decimals, fulfils it. At random, as in the document, test images have near copies "
    "among the training images; by sector they share no sample with them. `thesis` thresholds are chosen on images of "
    "which some are of the unknown targets, as in the document; `blind` ones without any."
)
EVERYWHERE = "What differs in every figure"


def write_page(folder, settings, stated, output):
    """Write the page of the results in `folder` (results/<name>) to the folder `output`: README.md and its PNG files.

    settings, stated: as of `page.write_report`.
    """
    results, output = Results(folder, settings, stated), Path(output)
    with style():
        chapters = {title: [build(results) for build in builds] for title, builds in CHAPTERS.items()}
    entries = [entry for every in chapters.values() for entry in every]
    drawn = pictures(entries)
    assert len({picture.name for picture in drawn}) == len(drawn), "two pictures of one name"
    output.mkdir(parents=True, exist_ok=True)
    for picture in drawn:
        (output / f"{picture.name}.png").write_bytes(picture.png)
    (output / PAGE).write_text(page(results, chapters))
    print(
        f"{len(entries)} entries, {len(drawn)} pictures; {sum(bool(entry.missing) for entry in entries)} lack something"
    )


def page(results, chapters):
    """The whole page. chapters: the Entries of each, by title."""
    entries = [entry for every in chapters.values() for entry in every]
    absent = [f"{entry.link}: {entry.missing}" for entry in entries if entry.missing]
    parts = [
        "# The thesis, figure by figure",
        "C. Stewart-Burger, *Classification of Synthesised ISAR Images of Small Complex Targets*, Stellenbosch "
        "University, 2023: what the figures and tables of its chapters 4 and 5 state, the same of a run of this "
        "repository, and why they may differ. Its figures 4.1 to 4.6, 4.11, 5.1, 5.2 and 5.5 are diagrams, and left "
        "out.",
        table([{"": name, "this run": words} for name, words in facts(results)]),
        READ,
        "## All published scores",
        _overview(entries),
        f"**Not part of this run:**\n\n{bullets(absent)}" if absent else "All of the document is part of this run.",
        f"## {EVERYWHERE}",
        bullets(everywhere(results)),
    ]
    for title, every in chapters.items():
        parts += [f"## {title}", *(text for entry in every for text in _entry(entry))]
    return "\n\n".join(part for part in parts if part) + "\n"


def _entry(entry):
    """An Entry as Markdown, block by block."""
    yield f"### {entry.heading}"
    yield f"*The document:* {entry.did}"
    if entry.missing:
        yield not_here(entry.missing)
    yield from map(block, entry.blocks)
    if words := counted(entry.judged):
        yield words
    if any(entry.why):
        yield f"*Why they may differ,* besides [{EVERYWHERE[0].lower()}{EVERYWHERE[1:]}](#{anchor(EVERYWHERE)}):"
        yield bullets(entry.why)


def _overview(entries):
    """One table of all published scores, each at the first figure that states it, and how many hold."""
    lines = {}
    for entry in entries:
        for line in entry.judged:
            lines.setdefault(tuple(line[key] for key in STATED), (entry, line))
    rows = [
        {
            "": entry.link,
            "what": f"{line['name']}, {line['words']}",
            "stated": line["stated"],
            "published": line["published"],
            "here": value_text(line["here"], line["snr_db"]),
            "as published": kept_text(line["holds"]),
        }
        for entry, line in lines.values()
    ]
    known = [line["holds"] for _, line in lines.values() if line["holds"] is not None]
    words = f"{sum(known)} of the {len(known)} that this run has hold." if known else "This run has none of them."
    return f"{words}\n\n{table(rows)}"


def facts(results):
    """The run in pairs of what and how much."""
    settings = results.settings
    pairs = [
        ("config", f"`{settings['name']}`, seed {settings['seed']}"),
        ("code", f"isarflow {version()}, commit {commit()}"),
    ]
    if results.learns:
        scores = results.folder / "learning" / "scores.csv"
        pairs.append(("date", f"{date.fromtimestamp(scores.stat().st_mtime).isoformat()}, of the scores"))
        pairs.append(("processor", ", ".join(sorted(results.times["machine"].unique()))))
    targets = ", ".join(f"{name} ({settings['targets'][name]['role']})" for name in results.targets)
    pairs.append(("targets", targets))
    if results.images_are_made:
        pairs.append(("images", _images(results)))
    if results.learns:
        differences = networks(results)
        pairs.append(("capsule network", "; ".join(differences) if differences else "of the document's size"))
        pairs.append(("learning", _learning(results.benchmarks)))
    return pairs


def _images(results):
    settings, noise = results.settings, results.settings["noise"]
    dataset = results.images(results.targets[0], "clean")
    views = dataset.sizes["elevation"] * dataset.sizes["azimuth"]
    count = len(results.targets) * views * len(noise["snr_db"]) * noise["realizations"]
    frequency = sweep.frequencies(settings["radar"]) / 1e9
    return (
        f"{count:,} noisy ones of {dataset.sizes['range']} × {dataset.sizes['crossrange']} pixels: "
        f"{len(results.targets)} targets, {dataset.sizes['elevation']} elevations, {dataset.sizes['azimuth']} "
        f"azimuths, {len(noise['snr_db'])} SNRs by {noise_words(noise, noise['definition'])}, {noise['realizations']} "
        f"realizations; {frequency[0]:g} to {frequency[-1]:g} GHz"
    )


def _learning(benchmarks):
    """The time of the learning stage's jobs, in words. benchmarks: as of `Results.benchmarks`."""
    jobs = benchmarks[benchmarks["step"].isin(LEARNING)]
    if not len(jobs):
        return "no times were recorded"
    seconds = jobs.groupby("step")["s"].sum()
    parts = ", ".join(f"{step} {duration(seconds[step])}" for step in LEARNING if step in seconds)
    longest = jobs.loc[jobs["s"].idxmax()]
    return (
        f"{duration(seconds.sum())} of jobs, which run side by side ({parts}); the longest, {longest['job']}, "
        f"{duration(longest['s'])}"
    )
