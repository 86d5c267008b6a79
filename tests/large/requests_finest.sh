# Requests of 1e-7 at 0.10" and 0.16" (tests/unit/test_requests.c): every object, 398 with ../shared.
for i in 15 16; do
    REQUESTS=all REQUEST=$i "$BUILD/unit/test_requests" | grep -v ' of the HDF$'
    failures=$((failures + PIPESTATUS[0]))
done
