import os

# The exact arrangement shares its numbers between threads without a lock: with several it crashes now and then.
os.environ["IGL_NUM_THREADS"] = "1"
