# Every object at every relative request, 0.10": 338 of them with ../shared (tests/unit/test_requests.c).
for i in 0 1 2 3 4 5; do
    REQUESTS=all REQUEST=$i "$TOP/${BUILD:-build}/unit/test_requests" | grep -v ' of the HDF$' || failures=$((failures + 1))
done
