from isarflow.core.words import counted


def test_counts_read_as_words():
    counts = {"merged_vertices": 1, "closed_holes": 0, "united_solids": 1, "split_t_junctions": 2}
    counts |= {"thinned_triangles": 43210}
    assert counted(counts) == "1 merged vertex, 1 united solid, 2 split t junctions, 43,210 thinned triangles"
    assert counted({"closed_holes": 0}) == ""
