from isarflow.core.job import job
from isarflow.imaging.store import make_noisy

with job(snakemake):
    settings = snakemake.params.settings
    make_noisy(
        snakemake.input.field,
        snakemake.output,
        settings["imaging"],
        target=snakemake.wildcards.target,
        noise={
            "seed": settings["seed"],
            "realizations": settings["noise.realizations"],
            "definition": settings["noise.definition"],
            "per": settings["noise.per"],
        },
    )
