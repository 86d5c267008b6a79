# 1e8 draws of each of 12 streams: chi-square and mean (tests/unit/test_rng.c).
NORMAL_DRAWS=100000000 "$BUILD/unit/test_rng"
failures=$?
