# An image of 12 MB goes from memory to standard output: the bytes of a file, and the same faults told.
echo '# DX DY MAG TYPE
0 0 20 star
31 -22 19 star' >scene
image() { simage scene -x 0.05 --size 2000,1500; }
ok "a file" simage scene -x 0.05 --size 2000,1500 -o file.fits
image | cat >pipe.fits
same "through a pipe" file.fits pipe.fits
image >redirected.fits
same "redirected" file.fits redirected.fits
echo before >behind
image >>behind
same "behind what is there" <(tail -c +8 behind) file.fits
{ image 2>said; echo $? >status; } | head -c 100000 >/dev/null
near "closed pipe: exit status" "$(cat status)" 1 0
ok "closed pipe: says so" grep -q 'reader went away' said
image >/dev/full 2>said && fail "/dev/full must fail" || pass "/dev/full fails"
ok "/dev/full: says so" grep -q '^simage: .*standard output' said
( ulimit -f 4000; image >short.fits 2>said ) && fail "a file that may not grow must fail" || pass "a file that may not grow fails"
between "and nothing half-written stays" "$(stat -c %s short.fits)" 0 0
