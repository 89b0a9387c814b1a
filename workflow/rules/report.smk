# report: one page that shows what was run and what came out, with its figures and tables beside it. Besides, on demand,
# the run beside its other seeds and other runs, and the radar cross-section of every target as numbers and a page.

PAGE_FILES = [
    *(in_repository(file) for file in of_page("*.html", "*.css", "*.js")),
    in_repository("resources/glossary.md"),
]
FULL_SIZE = [in_repository(path) for path in (*selection.full_size(config["name"]).values(), selection.KINDS)]


rule report:
    input:
        mesh_measures=expand(f"{FIELDS}/mesh/{{target}}.json", target=plan.meshed),
        meshes=expand(f"{FIELDS}/mesh/{{target}}-{{part}}.ply", target=plan.meshed, part=["source", *plan.bands]),
        scattering=expand(f"{FIELDS}/scattering/{{target}}.zarr", target=plan.targets),
        sphere=f"{FIELDS}/scattering/check/sphere.json" if plan.meshed else [],
        images=[
            f"{RESULTS}/imaging/{target}/{images}.zarr"
            for target, images in (selection.images_shown(config) if images_are_made(config) else ())
        ],
        scores=[f"{RESULTS}/learning/{table}.csv" for table in ("scores", "confusion", "validation") if plan.fitted],
        times=f"{RESULTS}/learning/times.json" if plan.fitted else [],
        curves=[f"{RESULTS}/learning/models/{fitted}" for fitted in plan.fitted],
        reconstructions=[f"{RESULTS}/learning/reconstructions/{fitted}.zarr" for fitted in plan.decoders()],
    output:
        # Not in Snakemake's own report: browsers do not open so large a page from within another.
        page=f"{RESULTS}/report/index.html",
        figures=in_report(directory(f"{RESULTS}/report/figures"), "Figures", "{name}.svg", figure="{name}"),
        tables=in_report(directory(f"{RESULTS}/report/tables"), "Tables", "{name}.csv", table="{name}"),
    log:
        f"{RESULTS}/logs/report.log",
    benchmark:
        f"{RESULTS}/benchmarks/report.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 8
    resources:
        mem_mb=4000,
    params:
        code=code("job_report.py", *of_page("section_*.py"), *plan.imager_files(), plan.solver_file()),
        files=lambda w: contents_of(*PAGE_FILES, *FULL_SIZE, *published("results")),
        settings=section(config, *config),
        stated=page_names(plan.models),
    message:
        "report: write {output.page} (progress in {log})"
    script:
        "../scripts/job_report.py"


# Of other runs it takes what is there: they have configs of their own.
rule compare:
    input:
        tables=lambda w: judged(is_seed=True),
        over_seeds=rules.seeds.output if len(plan.seeded) > 1 else [],
        validation=f"{RESULTS}/learning/validation.csv",
    output:
        page=f"{RESULTS}/report/compare.html",
        table=f"{RESULTS}/report/compare.csv",
    log:
        f"{RESULTS}/logs/compare.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        code=code("job_compare.py"),
        files=lambda w: contents_of(*PAGE_FILES),
        # One text for hundreds of tables.
        others=lambda w: hashlib.sha256(repr(contents_of(*judged(is_seed=False))).encode()).hexdigest(),
        settings=lambda w: section(config, "learning.kept", "noise.definition", "seed") | {"roots": or_exit(plan.roots)},
    message:
        "compare: write {output.page} (progress in {log})"
    script:
        "../scripts/job_compare.py"


rule rcs:
    input:
        mesh_measures=rules.report.input.mesh_measures,
        meshes=rules.report.input.meshes,
        scattering=rules.report.input.scattering,
    output:
        page=f"{RESULTS}/rcs/index.html",
        samples=expand(f"{RESULTS}/rcs/{{target}}.csv", target=config["targets"]),
        figures=directory(f"{RESULTS}/rcs/figures"),
        tables=directory(f"{RESULTS}/rcs/tables"),
    log:
        f"{RESULTS}/logs/rcs.log",
    benchmark:
        f"{RESULTS}/benchmarks/rcs.tsv"
    conda:
        "../../envs/report.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        code=code("job_rcs.py", plan.solver_file()),
        files=lambda w: contents_of(
            *PAGE_FILES,
            *(
                path
                for target in sorted(plan.targets)
                for path in field_files.paths(config["targets"][target].get("reference", []))
            ),
        ),
        settings=section(config, *config),
    message:
        "rcs: write {output.page} (progress in {log})"
    script:
        "../scripts/job_rcs.py"
