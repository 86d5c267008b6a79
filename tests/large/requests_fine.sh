# Requests of 1e-5 and 1e-6 at 0.10" (tests/unit/test_requests.c): every object, 338 with ../shared.
for i in 3 4; do
    REQUESTS=all REQUEST=$i "$BUILD/unit/test_requests" | grep -v ' of the HDF$'
    failures=$((failures + PIPESTATUS[0]))
done
