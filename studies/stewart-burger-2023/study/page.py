"""The page "the thesis, figure by figure": what it published, what a run has, why they differ. Markdown and PNGs."""

from datetime import date
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import study.figures
import study.networks
import study.sentences
from isarflow.core import sweep
from isarflow.report.conditions import noise_words
from isarflow.report.layout import duration, style
from isarflow.report.results import Results
from isarflow.report.section_run import commit, networks, version
from isarflow.report.vocabulary import select
from study.markdown import (
    NONE,
    PAGE,
    NotHere,
    Picture,
    anchor,
    block,
    bullets,
    folded,
    not_here,
    table,
)
from study.statements import KEPT, judge, present, value_text

FILE = "README.md"
LEARNING = ("train", "predict", "reconstruct", "timing", "scores")  # steps of the learning stage, as jobs are recorded
EVERYWHERE = "What differs in every figure"
MODULES = study.figures, study.networks, study.sentences  # of parts


def write_page(folder, settings, stated, output):
    """Write the page of the results in `folder` (results/<name>) to the folder `output`: README.md and its PNG files.

    settings, stated: as of `page.write_report`.
    """
    results, output = Results(folder, settings, stated), Path(output)
    with style():
        chapters = {title: [build(results, keys) for keys in every] for title, every in PAGE["chapters"].items()}
    figures = [figure for every in chapters.values() for figure in every]
    drawn = [part for figure in figures for _, part in figure.blocks if isinstance(part, Picture)]
    assert len({picture.name for picture in drawn}) == len(drawn), "two pictures of one name"
    output.mkdir(parents=True, exist_ok=True)
    for picture in drawn:
        (output / f"{picture.name}.png").write_bytes(picture.png)
    (output / FILE).write_text(page(results, chapters))
    lacking = sum(bool(figure.lacks) for figure in figures)
    print(f"{len(figures)} entries, {len(drawn)} pictures; {lacking} lack something")


def build(results, keys):
    """A figure or table of the thesis: what page.yaml says of it, and what a run has of it.

    Besides its keys: found, its statements as of `statements.judge`; there, those of its models that the run
    has; lacks, what the run does not have of it, in words; blocks, of its parts, each with the part's name;
    reasons, why values may differ.
    """
    figure = SimpleNamespace(**PAGE["defaults"] | {"picture": keys["names"][0]} | keys)
    own = select(results.published_scores, figure=keys["names"][0])
    figure.found = [judge(results, line) for line in own.to_dict("records")]
    figure.there, figure.lacks, figure.blocks, figure.reasons = [], [], [], []
    if figure.needs:
        figure.there, lack = present(results, figure.experiment, figure.models, figure.needs == "open")
        figure.lacks += [lack] if lack else []
    for name in figure.shows:
        try:
            figure.blocks.extend((name, block) for block in parts(results, figure, name))
        except NotHere as lack:
            if not figure.goes_on:
                figure.lacks.append(str(lack))
                return figure
            figure.blocks.append((name, not_here(lack)))
    figure.reasons = [words for name in figure.why for words in parts(results, figure, name)]
    return figure


def parts(results, figure, name):
    """What a part makes of the results: the function of that name, or the sentence as it stands."""
    functions = [getattr(module, name) for module in MODULES if hasattr(module, name)]
    return functions[0](results, figure) if functions else [PAGE["sentences"][name]]


def heading(figure):
    return ": ".join(text for text in (", ".join(figure.names), figure.title) if text)


def link(figure):
    return f"[{', '.join(figure.names)}](#{anchor(heading(figure))})"


def page(results, chapters):
    """The whole page. chapters: the figures of each, by title."""
    figures = [figure for every in chapters.values() for figure in every]
    everywhere = PAGE["everywhere"] + (PAGE["everywhere_learned"] if results.learns else [])
    absent = [f"{link(figure)}: {'; '.join(figure.lacks)}" for figure in figures if figure.lacks]
    texts = [
        *PAGE["head"],
        "## All published scores",
        _overview(figures),
        PAGE["read"],
        folded("The run", table([{"": name, "this run": words} for name, words in facts(results)])),
        f"**Not part of this run:**\n\n{bullets(absent)}" if absent else "All of the document is part of this run.",
        f"## {EVERYWHERE}",
        bullets(words for name in everywhere for words in parts(results, None, name)),
    ]
    for title, every in chapters.items():
        texts += [f"## {title}", *(text for figure in every for text in _written(figure))]
    return "\n\n".join(text for text in texts if text) + "\n"


def _written(figure):
    """A figure as Markdown, block by block."""
    yield f"### {heading(figure)}"
    yield f"*The document:* {figure.did}"
    if figure.lacks:
        yield not_here("; ".join(figure.lacks))
    seen = [figure.goes_on or isinstance(part, Picture) or name in PAGE["open"] for name, part in figure.blocks]
    yield from (block(part) for (_, part), is_open in zip(figure.blocks, seen, strict=True) if is_open)
    rest = [part for (_, part), is_open in zip(figure.blocks, seen, strict=True) if part and not is_open]
    if any(figure.reasons):
        rest.append(f"*Why they may differ,* besides [{EVERYWHERE[0].lower()}{EVERYWHERE[1:]}](#{anchor(EVERYWHERE)}):")
        rest.append(bullets(figure.reasons))
    if rest:
        yield folded(PAGE["folded"], "\n\n".join(rest))


def _overview(figures):
    """One table of all published scores, and how many hold, by its text and by one of the readings."""
    lines = [(figure, line) for figure in figures for line in figure.found]
    rows = [
        {
            "": link(figure),
            "what": f"{line['name']}, {line['words']}",
            "stated": line["stated"],
            "published": line["published"],
            "here": value_text(line["here"], line["snr_db"]),
            "as published": KEPT[line["holds"]],
            "read otherwise": _otherwise(line) if line["holds"] is False else "",
        }
        for figure, line in lines
    ]
    known = [line for _, line in lines if line["holds"] is not None]
    if not known:
        return f"This run has none of them.\n\n{table(rows)}"
    text = sum(line["holds"] for line in known)
    read = sum(line["holds"] or any(held for *_, held in line["otherwise"]) for line in known)
    words = PAGE["held"].format(text=text, read=read, all=len(known))
    used = {name for line in known if not line["holds"] for name, *_ in line["otherwise"]}
    readings = bullets(f"*{name}:* {reading['words']}" for name, reading in PAGE["readings"].items() if name in used)
    return "\n\n".join([words, table(rows), *([PAGE["read_otherwise"], readings] if readings else [])])


def _otherwise(line):
    """What the readings of a statement give that this run has of it, in bold where it holds."""
    values = [(name, value_text(value, line["snr_db"]), held) for name, value, held in line["otherwise"]]
    return "; ".join(f"**{name} {text}**" if held else f"{name} {text}" for name, text, held in values) or NONE


def facts(results):
    """The run in pairs of what and how much."""
    settings, said = results.settings, PAGE["facts"]
    pairs = [
        ("config", said["config"].format(**settings)),
        ("code", said["code"].format(version=version(), commit=commit())),
    ]
    if results.learns:
        made = date.fromtimestamp((results.folder / "learning" / "scores.csv").stat().st_mtime)
        pairs.append(("date", said["date"].format(date=made.isoformat())))
        pairs.append(("processor", ", ".join(sorted(results.times["machine"].unique()))))
    targets = (f"{name} ({settings['targets'][name]['role']})" for name in results.targets)
    pairs.append(("targets", ", ".join(targets)))
    if results.images_are_made:
        pairs.append(("images", said["images"].format(**_images(results))))
    if results.learns:
        pairs.append(("capsule network", "; ".join(networks(results)) or "of the document's size"))
        pairs.append(("learning", _learning(results.benchmarks)))
    return pairs


def _images(results):
    """The sizes of the run's images."""
    noise, sizes = results.settings["noise"], dict(results.images(results.targets[0], "clean").sizes)
    own = {"targets": len(results.targets), "snrs": len(noise["snr_db"]), "realizations": noise["realizations"]}
    count = np.prod([*own.values(), sizes["elevation"], sizes["azimuth"]])
    frequency, words = sweep.frequencies(results.settings["radar"]) / 1e9, noise_words(noise, noise["definition"])
    return own | sizes | {"count": count, "noise": words, "first": frequency[0], "last": frequency[-1]}


def _learning(benchmarks):
    """The time of the learning stage's jobs, in words. benchmarks: as of `Results.benchmarks`."""
    jobs = benchmarks[benchmarks["step"].isin(LEARNING)]
    if not len(jobs):
        return "no times were recorded"
    seconds, longest = jobs.groupby("step")["s"].sum(), jobs.loc[jobs["s"].idxmax()]
    steps = ", ".join(f"{step} {duration(seconds[step])}" for step in LEARNING if step in seconds)
    words = {"all": duration(seconds.sum()), "steps": steps, "job": longest["job"], "longest": duration(longest["s"])}
    return PAGE["facts"]["learning"].format(**words)
