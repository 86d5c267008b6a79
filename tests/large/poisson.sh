# 1e8 draws at each of 12 means: chi-square and mean (tests/unit/test_poisson.c).
POISSON_DRAWS=100000000 "$BUILD/unit/test_poisson"
failures=$?
