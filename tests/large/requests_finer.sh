# Requests of 1e-6 at 0.10", 0.16" and 0.04" (tests/unit/test_requests.c): every object, 398 with ../shared.
for i in 12 13 14; do
    REQUESTS=all REQUEST=$i "$BUILD/unit/test_requests" | grep -v ' of the HDF$'
    failures=$((failures + PIPESTATUS[0]))
done
