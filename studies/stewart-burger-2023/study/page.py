"""The page "the thesis, figure by figure": what it published, what a run has, why they differ. Markdown and PNGs."""

from datetime import date
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from isarflow.core.code import commit, version
from isarflow.core.sweep import frequencies, images_are_made
from isarflow.core.words import duration
from isarflow.report.conditions import noise_words
from isarflow.report.layout import style
from isarflow.report.results import Results
from isarflow.report.vocabulary import select
from study import figures, sentences
from study import networks as of_networks
from study.markdown import NONE, Picture, anchor, bullets, folded, say, table
from study.selection import PAGE
from study.statements import KEPT, judge, own_run, value_text

FILE = "README.md"
LEARNING = ("train", "predict", "reconstruct", "timing", "scores")  # steps of the learning stage, as jobs are recorded
EVERYWHERE = "What differs in every figure"


def write_page(folder, settings, stated, output):
    """Write the page of the results in `folder` (results/<name>) to the folder `output`: README.md and its PNG files.

    settings, stated: as of `page.write_report`.
    """
    if not images_are_made(settings):  # there is nothing to learn from
        settings = settings | {"learning": settings["learning"] | {"experiments": {}}}
    results, output = Results(folder, settings, stated), Path(output)
    with style():
        chapters = {title: [build(results, keys) for keys in every] for title, every in PAGE["chapters"].items()}
    built = [figure for every in chapters.values() for figure in every]
    drawn = [part for figure in built for _, part in figure.blocks if isinstance(part, Picture)]
    assert len({picture.name for picture in drawn}) == len(drawn), "two pictures of one name"
    output.mkdir(parents=True, exist_ok=True)
    for picture in drawn:
        (output / f"{picture.name}.png").write_bytes(picture.png)
    (output / FILE).write_text(page(results, chapters))
    print(f"{len(built)} entries, {len(drawn)} pictures; {sum(bool(of.lacks) for of in built)} lack something")


def build(results, keys):
    """Return a figure or table of the thesis: what page.yaml says of it, and what a run has of it.

    Besides its keys: heading and link, Markdown; found, its statements as of `statements.judge`; there, those of its
    models that the run has; lacks, what the run does not have of it, in words; blocks, of its parts, each with the
    part's name; reasons, why values may differ.
    """
    figure = SimpleNamespace(**PAGE["defaults"] | {"picture": keys["names"][0]} | keys)
    names = ", ".join(figure.names)
    figure.heading = f"{names}: {figure.title}" if figure.title else names
    figure.link = f"[{names}](#{anchor(figure.heading)})"
    own = select(results.published_scores, figure=figure.names[0])
    figure.found = [judge(results, line) for line in own.to_dict("records")]
    figure.there, figure.lacks = [], []
    figure.blocks, figure.reasons = [], []
    if figure.needs in ("closed", "open"):
        _find_models(results, figure)
    if figure.needs == "images" and not results.images_are_made:
        figure.lacks.append("images of known targets")
        return figure
    figure.blocks = [(name, block) for name in figure.shows for block in parts(results, figure, name)]
    figure.reasons = [words for name in figure.why for words in parts(results, figure, name)]
    return figure


def _find_models(results, figure):
    """Find those of a figure's models that its experiment has, split at random, and what is not part of this run."""
    run, is_open = own_run(results, figure.experiment), figure.needs == "open"
    if not run or (is_open and not run["open"]):
        figure.lacks.append(f"experiment `{figure.experiment}`{' in the open set' * is_open}, split at random")
        return
    figure.there = [model for model in figure.models if model in run["models"]]
    absent = [results.names.model(model).label for model in figure.models if model not in figure.there]
    figure.lacks += [f"{' and '.join(absent)} in experiment `{figure.experiment}`"] if absent else []


def parts(results, figure, name):
    """Return what a part makes of the results: blocks of the function of that name, or a sentence, maybe several."""
    for module in (figures, of_networks):
        if hasattr(module, name):
            return getattr(module, name)(results, figure)
    if hasattr(sentences, name):
        return [say(name, **values) for values in getattr(sentences, name)(results, figure)]
    values = sentences.of_run(results).get(name, {})
    return [] if values is None else [say(name, **values)]


def page(results, chapters):
    """Return the whole page as Markdown. chapters: the figures of each, by title."""
    built = [figure for every in chapters.values() for figure in every]
    everywhere = PAGE["everywhere"] + (PAGE["everywhere_learned"] if results.runs else [])
    absent = [f"{figure.link}: {'; '.join(figure.lacks)}" for figure in built if figure.lacks]
    texts = [
        *PAGE["head"],
        "## All published scores",
        _overview(built),
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
    """Return a figure as blocks of Markdown: what a reader sees at once, and folded what is left."""
    seen, rest = [f"### {figure.heading}", f"*The document:* {figure.did}"], []
    if figure.lacks:
        seen.append(f"**Not part of this run:** {'; '.join(figure.lacks)}.")
    for name, part in figure.blocks:
        (seen if isinstance(part, Picture) or name in PAGE["open"] else rest).append(str(part))
    if figure.reasons:
        rest.append(f"*Why they may differ,* besides [{EVERYWHERE[0].lower()}{EVERYWHERE[1:]}](#{anchor(EVERYWHERE)}):")
        rest.append(bullets(figure.reasons))
    text = "\n\n".join(part for part in rest if part)
    return [*seen, folded(PAGE["folded"], text)] if text else seen


def _overview(built):
    """Return one table of all published scores, and how many hold, by its text and by one of the readings."""
    rows, holding, read, used = [], [], 0, set()
    for figure, line in ((of, line) for of in built for line in of.found):
        row = {"": figure.link, "what": f"{line['name']}, {line['words']}", "stated": line["stated"]}
        row |= {"published": line["published"], "here": value_text(line["here"], line["snr_db"])}
        row |= {"as published": KEPT[line["holds"]], "read otherwise": ""}
        if line["holds"] is not None:
            holding.append(line["holds"])
        if line["holds"] is False:
            values = [(f"{name} {value_text(of, line['snr_db'])}", held) for name, of, held in line["otherwise"]]
            row["read otherwise"] = "; ".join(f"**{text}**" if held else text for text, held in values) or NONE
            read += any(held for *_, held in values)
            used |= {name for name, *_ in line["otherwise"]}
        rows.append(row)
    if not holding:
        return f"This run has none of them.\n\n{table(rows)}"
    words = PAGE["held"].format(text=sum(holding), read=sum(holding) + read, all=len(holding))
    readings = [f"*{name}:* {reading['words']}" for name, reading in PAGE["readings"].items() if name in used]
    return "\n\n".join([words, table(rows), *([PAGE["read_otherwise"], bullets(readings)] if readings else [])])


def facts(results):
    """Yield the run in pairs of what and how much."""
    settings, said = results.settings, PAGE["facts"]
    yield "config", said["config"].format(**settings)
    yield "code", said["code"].format(version=version(), commit=commit())
    if results.runs:
        made = date.fromtimestamp((results.folder / "learning" / "scores.csv").stat().st_mtime)
        yield "date", said["date"].format(date=made.isoformat())
        yield "processor", ", ".join(sorted(results.times["machine"].unique()))
    yield "targets", ", ".join(f"{name} ({settings['targets'][name]['role']})" for name in results.targets)
    if results.images_are_made:
        noise, sizes = settings["noise"], dict(results.images(results.targets[0], "clean").sizes)
        own = {"targets": len(results.targets), "snrs": len(noise["snr_db"]), "realizations": noise["realizations"]}
        count = np.prod([*own.values(), sizes["elevation"], sizes["azimuth"]])
        first, *_, last = frequencies(settings["radar"]) / 1e9
        own |= {"count": count, "noise": noise_words(noise, noise["definition"]), "first": first, "last": last}
        yield "images", said["images"].format(**own, **sizes)
    if results.runs:
        yield "capsule network", "; ".join(sentences.capsule_networks(results)) or "of the document's size"
        jobs, text = select(results.benchmarks, step=LEARNING), "no times were recorded"
        if len(jobs):
            seconds, longest = jobs.groupby("step")["s"].sum(), jobs.loc[jobs["s"].idxmax()]
            steps = ", ".join(f"{step} {duration(seconds[step])}" for step in LEARNING if step in seconds)
            words = {"all": duration(seconds.sum()), "steps": steps, "job": longest["job"]}
            text = said["learning"].format(**words, longest=duration(longest["s"]))
        yield "learning", text
