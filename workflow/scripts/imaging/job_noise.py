from core.job import job
from core.sweep import snr_of_label
from imaging.store import make_noisy

with job(snakemake):
    settings = snakemake.params.settings
    make_noisy(
        snakemake.input.field,
        snakemake.output[0],
        settings["imaging"],
        target=snakemake.wildcards.target,
        snr_db=snr_of_label(snakemake.wildcards.snr),
        noise={
            "seed": settings["seed"],
            "realizations": settings["noise.realizations"],
            "definition": settings["noise.definition"],
            "per": settings["noise.per"],
        },
    )
