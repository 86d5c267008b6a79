# Programs with several outputs and inputs: no output replaces a file that is read, by any of its roles; and where one
# output cannot be made none appears.
small_chain
cp noisy.fits wht.fits; cp noisy.fits second.fits; cp noisy.fits second_wht.fits; cp psf.fits kernel.fits
perl "$TOP/tests/fits.pl" make zero.fits 120 120 0
printf '# DX DY\n0 0\n0.5 0\n' >off.txt
echo dith.fits >list
drizzle dith.fits -o drz.fits
sum() { cat ./*.fits ./*.txt ./*.rrg list | cksum; }
before=$(sum)

# guarded WHAT FILE... -- COMMAND: with OUT in it standing for each of the files in turn, and for another name of the same file,
# whose suffix promises nothing
guarded() {
    local what=$1 files=() f g wrong=; shift
    while [ "$1" != -- ]; do files+=("$1"); shift; done
    shift
    for f in "${files[@]}"; do
        ln -f $f $f.in
        for g in $f $f.in; do
            local st=0
            timeout 60 "${@/OUT/$g}" >o 2>e </dev/null || st=$?
            if [ $st -eq 2 ]; then grep -q "$g: the name promises" e; else [ $st -eq 1 ] && grep -q "$g: is also an input" e; fi && [ ! -e made ] && [ "$(sum)" = "$before" ] || wrong="$wrong $g: exit $st: $(head -c 200 e);"
            rm -f made
        done
    done
    if [ -z "$wrong" ]; then pass "$what: none of ${files[*]} is replaced"; else fail "$what:$wrong"; fi
}
guarded "detect -o" noisy.fits wht.fits zero.fits second.fits second_wht.fits -- detect noisy.fits --weight wht.fits --mask zero.fits --measure second.fits --measure-weight second_wht.fits -o OUT
guarded "detect --region" noisy.fits wht.fits zero.fits second.fits second_wht.fits -- detect noisy.fits --weight wht.fits --mask zero.fits --measure second.fits --measure-weight second_wht.fits -o made --region OUT
guarded "detect --check-image" noisy.fits wht.fits zero.fits second.fits second_wht.fits -- detect noisy.fits --weight wht.fits --mask zero.fits --measure second.fits --measure-weight second_wht.fits -o made --check-image rms=OUT
guarded "rrgshape -o" noisy.fits cat.txt stars.rrg wht.fits zero.fits -- rrgshape noisy.fits cat.txt --stars stars.rrg --weight wht.fits --segmentation zero.fits -o OUT
guarded "rrgshape --region" noisy.fits cat.txt stars.rrg wht.fits zero.fits -- rrgshape noisy.fits cat.txt --stars stars.rrg --weight wht.fits --segmentation zero.fits -o made --region OUT
guarded "rrgshape --plain" noisy.fits cat.txt stars.rrg wht.fits zero.fits -- rrgshape noisy.fits cat.txt --stars stars.rrg --weight wht.fits --segmentation zero.fits -o made --plain OUT
guarded "rrgshape -o, stars of this run" stars.fits scat.txt -- rrgshape noisy.fits cat.txt --stars stars.fits,scat.txt -o OUT
guarded "rrgshape --region, PSF" kernel.fits -- rrgshape noisy.fits cat.txt --psf kernel.fits -o made --region OUT
guarded "rrgshape --stars-only" stars.fits scat.txt -- rrgshape --stars-only stars.fits scat.txt -o OUT
guarded "simage -o" scene.txt models.txt psf.fits noisy.fits -- simage scene.txt --models models.txt -p psf.fits --wcs noisy.fits -x 0.1 -o OUT
guarded "simage --truth" scene.txt models.txt psf.fits noisy.fits -- simage scene.txt --models models.txt -p psf.fits --wcs noisy.fits -x 0.1 -o made --truth OUT
guarded "galgen -o" models.txt -- galgen --library models.txt -n 3 -o OUT
guarded "galgen --models" models.txt -- galgen --library models.txt -n 3 -o made --models OUT
guarded "dither" half.fits off.txt -- dither half.fits --offsets off.txt -o OUT
guarded "addnoise" true.fits kernel.fits -- addnoise true.fits --depth 27 --depth-definition point5 -p kernel.fits -o OUT
guarded "drizzle" dith.fits drz.fits list -- drizzle @list --like drz.fits --flat -o OUT
guarded "psfgen" kernel.fits -- psfgen --from kernel.fits -o OUT
guarded "cutcat" shapes.txt stars.rrg -- cutcat shapes.txt --stars stars.rrg -o OUT
guarded "fom" cut.txt shapes.txt -- fom cut.txt shapes.txt -o OUT

none() { # WHAT COMMAND...: one of the outputs is in a folder that is not there, the other would be `made`
    local what=$1; shift
    fails "$what" 1 "$@"
    if [ -e made ]; then fail "$what: and the other appeared"; rm -f made; fi
}
none "detect, no catalogue" detect noisy.fits --check-image rms=made -o nowhere/cat
none "detect, no region" detect noisy.fits --check-image rms=made --region nowhere/reg -o cat
none "detect, no check image" detect noisy.fits --check-image rms=nowhere/rms --region made -o cat
none "rrgshape, no catalogue" rrgshape noisy.fits cat.txt --psf none --region made -o nowhere/cat
none "rrgshape, no region" rrgshape noisy.fits cat.txt --psf none --region nowhere/reg -o made
none "rrgshape, no catalogue, --plain" rrgshape noisy.fits cat.txt --psf none --plain made -o nowhere/cat
none "rrgshape, no second catalogue" rrgshape noisy.fits cat.txt --psf none --plain nowhere/cat -o made
none "simage, no image" simage scene.txt --models models.txt -x 0.1 --truth made -o nowhere/image
none "simage, no truth" simage scene.txt --models models.txt -x 0.1 --truth nowhere/truth -o made
none "galgen, no list" galgen -n 3 --models made -o nowhere/scene
none "galgen, no models" galgen -n 3 --models nowhere/models -o made

# where the disk is full for the second output, the first is not there either; earlier files stay
mkdir disk; trap "umount disk 2>/dev/null" EXIT
if [ "$(id -u)" = 0 ] && mount -t tmpfs -o size=256k none disk 2>mount.err; then
    full() { # WHAT NAME NAME COMMAND...: two outputs, 20 KiB left on the disk beside the smaller of them
        local what=$1 a=$2 b=$3 earlier size pages free; shift 3
        ok "$what: with room" "$@"
        size=$(wc -c <$a); [ "$(wc -c <$b)" -lt "$size" ] && size=$(wc -c <$b)
        near "$what: the larger does not fit beside the smaller" "$(($(cat $a $b | wc -c) > 2 * size + 20480))" 1 0
        rm -f disk/*
        pages=$(((size + 4095) / 4096)) free=$((236 - 4 * pages)); head -c $((free * 1024)) /dev/zero >disk/filler
        fails "$what: a full disk" 1 "$@"
        if [ "$(ls -A disk)" = filler ]; then pass "$what: neither is there"; else fail "$what: $(ls -A disk | tr '\n' ' ')"; fi
        for earlier in $a $b; do
            rm -f $a $b; echo old >$earlier
            fails "$what: a full disk, with an earlier $earlier" 1 "$@"
            if [ "$(cat $earlier)" = old ] && [ "$(ls -A disk | wc -l)" = 2 ]; then pass "$what: it stays, nothing else is there"; else fail "$what: $(ls -l disk)"; fi
        done
        rm -f disk/*
    }
    full galgen disk/models disk/scene galgen -n 200 --models disk/models -o disk/scene
    full detect disk/rms disk/cat detect noisy.fits --check-image rms=disk/rms -o disk/cat
    full simage disk/truth disk/image simage scene.txt --models models.txt -x 0.1 --truth disk/truth -o disk/image
    full rrgshape disk/reg disk/shapes rrgshape noisy.fits cat.txt --psf none --region disk/reg -o disk/shapes
    umount disk; trap - EXIT
else
    skip "a full disk: tmpfs cannot be mounted here"
fi

# A name that promises another format than it would get is a mistake of the command line.
mkdir names; cd names || exit 1
for f in noisy.fits cat.txt stars.rrg scene.txt models.txt psf.fits half.fits true.fits dith.fits shapes.txt cut.txt stars.fits scat.txt; do ln -s ../$f .; done
ls >../kept
promise() { # WHAT NAME PROMISE COMMAND...: the name in place of OUT
    local what=$1 name=$2 of=$3; shift 3
    fails "$what: $name" 2 "${@/OUT/$name}"
    if grep -q "$name: the name promises $of, but" cmd.err && [ "$(ls -A | grep -vE '^cmd\.(out|err)$')" = "$(cat ../kept)" ]; then pass "$what: $of"; else fail "$what: $(cat cmd.err) $(ls | tr '\n' ' ')"; fi
}
while read -r p c; do
    for n in "x.png a PNG picture" "X.PNG a PNG picture" "x.fits.gz a compressed file" "x.txt text" "x.cat a catalogue" "x.fz a tile-compressed image"; do promise $p "${n%% *}" "${n#* }" $p $c -o OUT; done
done <<END
psfgen --pupil-grid 64 --size 32
simage scene.txt --models models.txt -x 0.1
dither -n 2 half.fits
addnoise --depth 27.7 true.fits
drizzle dith.fits
END
while read -r p c; do
    for n in "x.png a PNG picture" "x.csv comma-separated values" "x.cat.gz a compressed file" "x.vot VOTable" "x.reg regions of DS9"; do promise $p "${n%% *}" "${n#* }" $p $c -o OUT; done
    [ $p = detect ] || promise $p x.ldac FITS_LDAC $p $c -o OUT
done <<END
galgen --stars
detect noisy.fits
rrgshape noisy.fits cat.txt --psf none
cutcat shapes.txt --stars stars.rrg
fom cut.txt
END
promise "galgen --models" x.png "a PNG picture" galgen -n 3 --models OUT -o made
promise "simage --truth" x.png "a PNG picture" simage scene.txt --models models.txt -x 0.1 --truth OUT -o made
promise "rrgshape --plain" x.png "a PNG picture" rrgshape noisy.fits cat.txt --psf none --plain OUT -o made
promise "rrgshape --region" x.fits FITS rrgshape noisy.fits cat.txt --psf none --region OUT -o made
promise "detect --region" x.cat "a catalogue" detect noisy.fits --region OUT -o made
promise "detect --check-image" rms=x.png "a PNG picture" detect noisy.fits --check-image OUT -o made
promise "detect --check-image, the second" rms=x.jpg "a JPEG picture" detect noisy.fits --check-image background=b.fits --check-image OUT -o made
promise "detect --negative, a count" x.fits FITS detect noisy.fits --negative -o OUT
promise "fom --table" x.fits FITS fom --table cut.txt -o OUT
fails "detect --negative writes no regions" 2 detect noisy.fits --negative --region x.reg
for n in x.fit x.fts x.FITS; do
    ok "a catalogue called $n" cutcat --only-where cat.txt -o $n
    near "is FITS" "$(head -c 9 $n | grep -c '^SIMPLE  =')" 1 0
done
for n in image image.0.10 .png dir.png/image sci.img; do mkdir -p dir.png; ok "an image called $n" addnoise --depth 27.7 true.fits -o $n; done
for n in shapes.rrg use.use 0.10 list.txt a.cat .csv; do ok "a catalogue called $n" cutcat --only-where cat.txt -o $n; same "is text" <(head -c 2 $n) <(printf '# '); done
