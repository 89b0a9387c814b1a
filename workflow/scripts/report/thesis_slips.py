"""Where the thesis's text, listings and figures do not agree with each other, and what that makes in a run's values."""

from report import thesis_anew as anew
from report.layout import BLACK, signed
from report.plots import finish, panels
from report.published import ADAPTATIONS
from report.selection import everywhere_networks
from report.thesis_compare import SPLIT, ours, own_run, trained_words, values_table
from report.thesis_markdown import Entry, not_here, picture, table
from report.thesis_networks import (
    FCNN,
    HEADINGS,
    RUNS,
    all_azimuths,
    effect_cells,
    high_snr,
    judged_anew,
    printed_matrix,
)
from report.vocabulary import ACCURACY, F1, POWERS, select, snr_axis

# Confidence scores whose thresholds are chosen anew, by experiment and model.
THRESHOLDS = {("fcnn_open", "fcnn"): ("softmax", "openmax"), ("capsule_open", "capsule"): ("mse", "zncc")}
# What is shown by both definitions of SNR: experiment, model and confidence score.
BY_POWER = (("multi_elevation", "knn", ""), ("capsule_open", "capsule", "mse"), ("capsule_open", "capsule", "zncc"))


def slips(results):
    """The Entry of all slips; of each what it is, and what this run has to say of it."""
    each = (
        trained_with_noise,
        all_azimuths_counted,
        threshold_on_test_images,
        mean_power,
        reconstruction,
        matrix_and_table,
        small,
    )
    networks = (*((run, "fcnn") for run in RUNS), ("capsule_open", "capsule"))
    missing = [f"`{network[0]}`" for network in networks if not judged_anew(results, *network)]
    return Entry(
        ("Slips of the document",),
        "",
        "Its text, its listings and its figures do not always say the same. What changes a figure is repeated here.",
        missing=f"experiments in the open set, split at random: {', '.join(missing)}" if missing else "",
        blocks=tuple(part for slip in each for part in slip(results) if part),
    )


def trained_with_noise(results):
    """(a) Training images at 24 dB instead of without noise."""
    words = (
        "**(a) Training images.** Its text says that both networks learned images without noise. The one listing that "
        "loads images (D.1, of the capsule network) loads those at 24 dB, three realizations, to train; that of the "
        "FCNN (5.1) does not show what it learns. Experiment `fcnn_listing` trains the FCNN at 24 dB."
    )
    if not judged_anew(results, "fcnn_listing", "fcnn"):
        return words, not_here("experiment `fcnn_listing`")
    curves = []
    kinds = [("fcnn", "", "closed set, accuracy")]
    kinds += [(*ADAPTATIONS[name], f"open set, weighted F1, {HEADINGS[name]}") for name in FCNN]
    for model, score, label in kinds:
        for run in (run for run in RUNS if judged_anew(results, run, model)):
            rows = ours(results, run, model, F1 if score else ACCURACY, score)
            curves.append((f"{label}, trained {trained_words(results.runs[run])}", rows))
    return words, values_table(curves)


def all_azimuths_counted(results):
    """(b) All azimuths in Fig. 5.4."""
    words = (
        "**(b) Images that trained are counted.** The rows of Fig. 5.4 have 13,794 images each, which is 242 azimuths "
        "x 19 elevations x 3 realizations: all there are, of which 70 % of the azimuths trained."
    )
    networks = everywhere_networks(results.runs) if results.learns else []
    if not networks:
        return words, not_here("a fully connected network in the open set, split at random")
    snr, rows = high_snr(results), []
    for run, model in networks:
        predictions = results.predictions(run, model, snr)
        tested = select(predictions, side="test", role=["known", "unknown"])
        for name in (name for name in FCNN if ADAPTATIONS[name][0] == model):
            score = ADAPTATIONS[name][1]
            own = anew.weighted_f1(anew.rejecting(tested, score, anew.chosen(predictions, score)))
            every = all_azimuths(results, run, model, score)
            row = {
                "FCNN": f"{HEADINGS[name]}, trained {trained_words(results.runs[run])}",
                "test images": f"{len(tested):,}",
            }
            row |= {"weighted F1": f"{own:.4f}", "all images": f"{len(every):,}"}
            f1 = anew.weighted_f1(every)
            rows.append(row | {"their weighted F1": f"{f1:.4f}", "what that adds": signed(f1 - own, 4)})
    return words, f"At {snr:g} dB, with the thresholds that the validation images choose:", table(rows)


def threshold_on_test_images(results):
    """(c) Thresholds from the test images."""
    words = (
        "**(c) Thresholds from the test images.** Its text chooses thresholds for the largest F1 on a small "
        "validation set. Its listing D.1, of the capsule network with the ZNCC, takes the test images of each SNR "
        "instead, and the threshold with the fewest known images below it and unknown ones above. Of the FCNN no such "
        "listing is printed; the same is done with its scores here."
    )
    there = {network: scores for network, scores in THRESHOLDS.items() if judged_anew(results, *network)}
    if not there:
        return words, not_here("networks in the open set, split at random")
    snrs, rows, said = sorted(results.settings["noise"]["snr_db"]), [], []
    drawing, grid = panels(1, len(there), max(1 + 3.9 * len(there), 6.6), 3.6)
    for axes, (network, scores) in zip(grid.flat, there.items(), strict=True):
        tables = {snr: results.predictions(*network, snr) for snr in snrs}
        for score in scores:
            effects = [anew.effect(tables[snr], score, results.settings["seed"]) for snr in snrs]
            label, look = results.names.method(network[1], score), results.names.score(score)
            axes.plot(snrs, [found.f1 for found in effects], color=look.color, marker=look.marker, label=look.label)
            axes.plot(snrs, [found.f1_by_errors for found in effects], color=look.color, ls="--")
            rows.append({"": label, **effect_cells(effects[snrs.index(high_snr(results))], score)})
            gains = [found.f1_by_errors - found.f1 for found in effects]
            said.append(f"{label} {signed(min(gains), 4)} to {signed(max(gains), 4)}")
        axes.set_title(results.names.model(network[1]).label)
    grid[0, 0].plot([], [], color=BLACK, ls="--", label="threshold from the test images, by errors")
    finish(drawing, grid, snr_axis(results.definition), "weighted F1")
    alt = "Weighted F1 against the test SNR with thresholds from validation images, and by errors from test images."
    return (
        words,
        f"At {high_snr(results):g} dB, split at random:",
        table(rows),
        picture("Slips, threshold", drawing, alt),
        f"What it adds over all SNRs: {'; '.join(said)}.",
    )


def mean_power(results):
    """(d) The definition of SNR."""
    words = (
        "**(d) SNR.** Its text defines the signal's power as the mean over the samples within 3 dB of an aperture's "
        "peak (eq. 3.21). Its listing B.1 computes that, and then adds noise by the mean power of all samples."
    )
    if not results.images_are_made:
        return words, not_here("images")
    attrs = {
        name: results.images(name, "clean").attrs for name in (*results.of_role("known"), *results.of_role("unknown"))
    }
    offsets = [f"{name} {of['snr_definition_offset_db']:.1f} dB" for name, of in attrs.items()]
    curves = []
    for experiment, model, score in (case for case in BY_POWER if own_run(results, case[0])):
        case = {"experiment": experiment, "split": SPLIT, "model": model, "score": score, "elevation": "all"}
        case |= {"metric": F1 if score else ACCURACY, "threshold": "thesis" if score else ""}
        label = f"{results.names.method(model, score)}, {'weighted F1' if score else 'accuracy'}, SNR by"
        for definition, scores in results.by_definition.items():
            curves.append((f"{label} {POWERS[definition]}", select(scores, **case)))
    there = f"By the text's definition the same noise reads higher, on average over images: {', '.join(offsets)}."
    return words, there if offsets else "", values_table(curves)


def reconstruction(results):
    """(e) The weight of the reconstruction."""
    own = results.settings["learning"]["models"].get("capsule", {}).get("reconstruction")
    here = f" Here it is {own:g} times the mean." if own is not None else ""
    return (
        "**(e) Weight of the reconstruction.** Its text has 0.0005 times the sum of squares, which over 32 x 32 "
        f"pixels is 0.512 times the mean; its listing D.1 has 0.392 times the mean, which is 0.0005 x 28 x 28.{here}",
    )


def matrix_and_table(results):
    """(f) What Table 5.2 prints is not what Fig. 5.4 has."""
    parts = []
    for name in FCNN:
        printed = select(results.published_scores, model=name, metric="weighted_f1")["value"].iloc[0]
        computed = anew.printed_f1(printed_matrix(results, name))
        parts.append(f"{HEADINGS[name]} {printed} printed, {computed:.4f} from the matrix")
    return (f"**(f) Table 5.2 beside Fig. 5.4.** The weighted F1 of its own matrices: {'; '.join(parts)}.",)


def small(results):
    """(g) What is named only."""
    return (
        "**(g) Smaller ones.** Listing D.1 trains at 168 of the 242 azimuths and tests at the other 74, which gives "
        "the 4,218 images a target of Fig. 5.11; the 340 and 6,460 training images of Table 4.2 are 170 azimuths. It "
        "has no third set: its training is watched on the test images, the unknown targets among them. Listing B.1 "
        "makes ten realizations of the noise, listing D.1 reads three.",
    )
