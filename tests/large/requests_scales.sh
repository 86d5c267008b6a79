# 0.24", without a PSF, and 1e-7 with a floor at 0.10", 0.16" and 0.04" (tests/unit/test_requests.c): every object, 398 with ../shared.
for i in 18 19 20 21 22 23; do
    REQUESTS=all REQUEST=$i "$BUILD/unit/test_requests" | grep -v ' of the HDF$'
    failures=$((failures + PIPESTATUS[0]))
done
