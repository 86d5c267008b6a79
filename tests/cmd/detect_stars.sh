# STAR_PROB on fields of stars and galaxies at 0.10 arcsec, against the scene: less than 1 % of galaxies above S/N 10 called stars.
psfgen -o psf.fits
score() { # SEED: appends "kind STAR_PROB S/N" of the objects within 0.3" and 1 mag of the scene's
    galgen --field 110 -s "$1" -o g.txt --models gm.txt
    galgen --stars -n 100 --field 110 -s "$(($1 + 50))" -o t.txt
    { cat g.txt; awk '!/^#/ { print $1 + 900000, $2, $3, 20 + 7 * NR / 100, "star", 0, 0, 0, 0, 0 }' t.txt; } >scene.txt
    simage scene.txt --models gm.txt -p psf.fits -x 0.10 --size 1100,1100 --accuracy 1e-3 | addnoise -q --depth 27.7 -s "$1" -o f.fits
    detect -q f.fits -o f.cat
    awk -v x=0.10 -v n=1100 '/^#/ { if (FNR != NR) { k = split($0, q, " "); for (i = 2; i <= k; i++) c[q[i]] = i - 1 } next }
        FNR == NR { X[++t] = $2 / x + (n + 1) / 2; Y[t] = $3 / x + (n + 1) / 2; M[t] = $4; T[t] = $5; next }
        { b = (0.3 / x)^2; hit = 0; for (i = 1; i <= t; i++) { d = ($c["X_IMAGE"] - X[i])^2 + ($c["Y_IMAGE"] - Y[i])^2; dm = $c["MAG_AUTO"] - M[i]
            if (d < b && dm * dm < 1) { b = d; hit = i } }
          if (hit) print T[hit], $c["STAR_PROB"], $c["FLUX_AUTO"] / $c["FLUXERR_AUTO"] }' scene.txt f.cat >>prob.txt
}
score 3
score 4
read -r galaxies called stars found < <(awk '$3 > 10 { if ($1 == "star") { s++; f += $2 > 0.5 } else { g++; c += $2 > 0.5 } } END { print g, c + 0, s, f }' prob.txt)
between "galaxies above S/N 10" "$galaxies" 500 2000
between "of them called stars: $called, part" "$(awk "BEGIN { print $called / $galaxies }")" 0 0.0099
between "stars above S/N 10" "$stars" 100 200
between "of them called stars" "$(awk "BEGIN { print $found / $stars }")" 0.95 1
near "without a PSF every one has 0.5" "$(sed 's/PSFFWHM = /XSFFWHM = /' f.fits >g.fits; detect -q g.fits | col /dev/stdin STAR_PROB | sort -u)" 0.5 0
