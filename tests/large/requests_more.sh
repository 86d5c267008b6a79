# Every object at other pixel scales, with a floor, and without a PSF (tests/unit/test_requests.c).
for i in 6 7 8 9 10 11 12 13; do
    REQUESTS=all REQUEST=$i "$TOP/${BUILD:-build}/unit/test_requests" | grep -v ' of the HDF$' || failures=$((failures + 1))
done
