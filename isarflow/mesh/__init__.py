import os

# With several threads the exact arrangement gives its triangles in an order that changes from run to run.
os.environ["IGL_NUM_THREADS"] = "1"
