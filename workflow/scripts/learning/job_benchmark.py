from isarflow.core.job import job
from isarflow.learning.benchmark import write_leaderboard

with job(snakemake):
    write_leaderboard(
        snakemake.input.scores, snakemake.params.settings["noise.definition"], snakemake.output.leaderboard
    )
