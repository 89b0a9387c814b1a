"""The page "the thesis, figure by figure": what it published, what a run has, why they differ. Markdown and PNGs."""

from datetime import date
from functools import reduce
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from isarflow.core.words import number, several
from isarflow.report import section_run
from isarflow.report.layout import style
from isarflow.report.results import Results
from isarflow.report.vocabulary import listed, select
from study import figures, texts
from study.markdown import anchor, bullets, folded, table
from study.selection import PAGE
from study.statements import AT_RANDOM, judge

EVERYWHERE = "What differs in every figure"


def write_page(folder, settings, stated, output):
    """Write the page of the results in `folder` (results/<name>) to the folder `output`: README.md and its PNG files.

    settings, stated: as of `page.write_report`.
    """
    results, output = Results(folder, settings, stated), Path(output)
    output.mkdir(parents=True, exist_ok=True)
    with style():
        chapters = {title: [build(results, keys, output) for keys in of] for title, of in PAGE["chapters"].items()}
    (output / "README.md").write_text(page(results, chapters))


def build(results, keys, folder):
    """Return a figure or table of the thesis: what page.yaml says of it, and what a run has of it.

    Besides its keys: folder, of pictures; heading and link, Markdown; found, its statements as of `statements.judge`;
    experiment and models, the first that it uses; there, all those that the run has; lacks, what the run does not
    have, in words; blocks, of its parts, each with the part's name; reasons, why values may differ.
    """
    figure = SimpleNamespace(**PAGE["defaults"] | {"picture": keys["names"][0], "folder": folder} | keys)
    names = ", ".join(figure.names)
    figure.heading = f"{names}: {figure.title}"
    figure.link = f"[{names}](#{anchor(figure.heading)})"
    own = select(results.published_scores, figure=figure.names[0])
    figure.found = [judge(results, line) for line in own.to_dict("records")]
    figure.experiment, figure.models = next(iter(figure.uses.items()), ("", []))
    figure.there, figure.lacks = [], []
    for experiment, models in figure.uses.items():
        runs = [run for run in results.runs.values() if run["experiment"] == experiment and run["split"] in AT_RANDOM]
        named = {model for run in runs if run["open"] or not figure.open for model in run["models"]}
        there = [model for model in models if model in named]
        figure.there += there
        if len(there) < len(models):
            labels = listed([results.names.model(model).label for model in models if model not in there])
            opened = " in the open set" if figure.open else ""
            figure.lacks.append(f"{labels} in experiment `{experiment}`{opened}, split at random")
    shown = [name for name in figure.shows if name in PAGE["seen"] or figure.there or not figure.uses]
    figure.blocks = [(name, block) for name in shown for block in parts(results, figure, name)]
    figure.reasons = [words for name in figure.why for words in parts(results, figure, name)]
    return figure


def parts(results, figure, name):
    """Return what a part makes of the results: blocks of its function, or its sentence for each of its values."""
    functions = [getattr(module, name) for module in (figures, texts) if hasattr(module, name)]
    sentence = PAGE["sentences"].get(name) if functions else PAGE["sentences"][name]
    if isinstance(sentence, dict):
        return list(texts.measured(results, **sentence))
    made = functions[0](results, figure) if functions else [{}]  # a sentence that stands as it is
    return [sentence.format(**values) for values in made] if sentence else list(made)


def page(results, chapters):
    """Return the whole page as Markdown. chapters: the figures of each, by title."""
    built = [figure for every in chapters.values() for figure in every]
    absent = [f"{figure.link}: {'; '.join(figure.lacks)}" for figure in built if figure.lacks]
    blocks = [
        *PAGE["head"],
        texts.overview(built),
        PAGE["read"],
        folded("The run", table([{"": name, "this run": words} for name, words in facts(results).items()])),
        f"**Not part of this run:**\n\n{bullets(absent)}" if absent else "All of the document is part of this run.",
        f"## {EVERYWHERE}",
        table([*sweep(results.settings)]),
        bullets(words for name in PAGE["everywhere"] for words in parts(results, None, name)),
        "## Models of the known targets",
        texts.models_of_targets(built),
    ]
    for title, every in chapters.items():
        blocks += [f"## {title}", *(text for figure in every for text in _written(figure))]
    return "\n\n".join(text for text in blocks if text) + "\n"


def _written(figure):
    """Return a figure as blocks of Markdown: what a reader sees at once, and folded what is left."""
    seen, rest = [f"### {figure.heading}", f"*The document:* {figure.did}"], []
    if figure.lacks:
        seen.append(f"**Not part of this run:** {'; '.join(figure.lacks)}.")
    for name, part in figure.blocks:
        (seen if part.startswith("![") or name in PAGE["seen"] else rest).append(part)
    if figure.reasons:
        rest.append(f"*Why they may differ,* besides [{EVERYWHERE[0].lower()}{EVERYWHERE[1:]}](#{anchor(EVERYWHERE)}):")
        rest.append(bullets(figure.reasons))
    text = "\n\n".join(part for part in rest if part)
    return [*seen, folded(PAGE["folded"], text)] if text else seen


def sweep(settings):
    """Return the document's settings of sweep and images beside the run's, a row for each."""
    for words, (key, theirs) in PAGE["sweep"].items():
        here = reduce(lambda part, name: part.get(name, {}), key.split("."), settings)
        both = {"the document": theirs, "this run": "otherwise" if here == {} else here}
        yield {"": words} | {who: value if isinstance(value, str) else number(value) for who, value in both.items()}


def facts(results):
    """Return the run in pairs of what and how much."""
    settings, said = results.settings, PAGE["facts"]
    found = {"config": said["config"].format(**settings)}
    found |= {key: words for key, words in section_run.facts(results) if key in ("Made with", "Computed in")}
    if results.runs:
        made = date.fromtimestamp((results.folder / "learning" / "scores.csv").stat().st_mtime)
        found["date"] = said["date"].format(date=made.isoformat())
        found["processor"] = ", ".join(sorted(results.times["machine"].unique()))
        found["prediction times"] = f"with {several(results.times['threads'].max(), 'thread')}"
    found["targets"] = ", ".join(f"{name} ({settings['targets'][name]['role']})" for name in results.targets)
    if results.images_are_made:
        noise, sizes = settings["noise"], dict(results.images(results.targets[0], "clean").sizes)
        own = {"targets": len(results.targets), "snrs": len(noise["snr_db"]), "realizations": noise["realizations"]}
        count = np.prod([*own.values(), sizes["elevation"], sizes["azimuth"]])
        found["images"] = said["images"].format(**own, **sizes, count=count)
    return found
