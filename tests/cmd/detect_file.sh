# detect reads the pixels where the file has them: the same from a file, a pipe, a gzip file, an extension, whole numbers; a file that is cut
# or changed while it is read is an error, nothing else.
small_chain
detect -q noisy.fits -o ref.cat
rows() { grep -v '^#' "$1"; }
detect -q - <noisy.fits >a.cat; same "from standard input, a file" <(rows ref.cat) <(rows a.cat)
cat noisy.fits | detect -q - >a.cat; same "from a pipe" <(rows ref.cat) <(rows a.cat)
gzip -c noisy.fits >z.fits.gz; detect -q z.fits.gz >a.cat; same "from gzip" <(rows ref.cat) <(rows a.cat)
{ head -c 7 /dev/zero; cat noisy.fits; } >late
{ head -c 7 >/dev/null; detect -q - >a.cat; } <late; same "from the middle of a file" <(rows ref.cat) <(rows a.cat)
detect -q noisy.fits --check-image rms=rms.fits >a.cat; same "with a check image, for which it is held in memory" <(rows ref.cat) <(rows a.cat)
perl -e 'local $/; $_ = <STDIN>; my $h = substr $_, 0, index($_, "END" . " " x 77) + 80; my $at = int((length($h) + 2879) / 2880) * 2880; my ($nx, $ny) = map { $h =~ /NAXIS$_ *= *(\d+)/ } 1, 2;
    my @v = map { int 100 * $_ } unpack "f>" . $nx * $ny, substr $_, $at; $h =~ s/BITPIX *= *-32/"BITPIX  = " . sprintf "%20d", $ARGV[0]/e;
    print $h =~ s/END {77}$/sprintf "%-80s%-80s", "BSCALE  = 0.01", "END"/er; my $n = length($h) + 80; print " " x ((2880 - $n % 2880) % 2880);
    my $d = pack(($ARGV[0] == 32 ? "l>*" : "d>*"), @v); print $d, "\0" x ((2880 - length($d) % 2880) % 2880)' 32 <noisy.fits >whole.fits
detect -q whole.fits >a.cat; detect -q whole.fits --check-image rms=rms.fits >b.cat
near "whole numbers with BSCALE: objects" "$(rows a.cat | wc -l)" "$(rows ref.cat | wc -l)" 1
same "the same held in memory" <(rows a.cat) <(rows b.cat)

# the weight comes through a pipe when the image is open: detect waits for it
mkfifo w.fifo
spoilt() { # WHAT SAYS THREADS COMMAND: done to image.fits meanwhile
    local what=$1 says=$2 j=$3 st=0; shift 3
    cp noisy.fits image.fits
    rm -f out.cat
    timeout 60 detect -q -j "$j" image.fits --weight w.fifo -o out.cat 2>err &
    { "$@"; cat true.fits; } >w.fifo
    wait $! || st=$?
    near "$what, $j threads: status" $st 1 0
    [ "$(grep -c "^detect: image.fits: .*$says" err) $(wc -l <err)" = "1 1" ] && pass "$what, $j threads: one line" || fail "$what, $j threads: $(cat err)"
    near "$what, $j threads: outputs left" "$(find . -name 'out.cat' -o -name '.out*' | wc -l)" 0 0
}
for j in 1 2; do
    spoilt "cut to its header" "cannot be read any more" $j truncate -s 5760 image.fits
    spoilt "cut to nothing" "cannot be read any more" $j truncate -s 0 image.fits
    spoilt "longer by a byte" "was changed" $j sh -c 'printf x >>image.fits'
    spoilt "a pixel changed" "was changed" $j sh -c 'printf "\100" | dd of=image.fits bs=1 seek=9000 conv=notrunc 2>/dev/null'
done
cp noisy.fits image.fits
timeout 60 detect -q image.fits --weight w.fifo -o out.cat & { rm image.fits; cat true.fits; } >w.fifo; wait $!
ok "a file that is removed is read to its end" test -s out.cat
