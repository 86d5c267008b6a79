# Other pixel scales, and without a PSF (tests/unit/test_requests.c): every object, 338 with ../shared.
for i in 6 7 8 11 12 13; do
    REQUESTS=all REQUEST=$i "$BUILD/unit/test_requests" | grep -v ' of the HDF$'
    failures=$((failures + PIPESTATUS[0]))
done
